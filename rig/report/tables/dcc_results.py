"""The results of a digital certificate: values with all digits, with U or their covariance, by quantity."""

import math
from collections.abc import Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import ConditionsEntry, DetectionLimitEntry, Freedom, Matrix6
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.result_file import GyroscopeEntry, VerificationEntry
from rig.errors import Refused
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.statistics.coverage import PROBABILITY, find_ellipsoid_factor
from rig.report.findings.characteristic import Term
from rig.report.tables.certificate import AXES
from rig.report.tables.coverage_statements import coverage_sentence, joint_factor
from rig.report.tables.xml_parts import dcc, real_list, text
from rig.report.words.detection_limit_words import list_limits
from rig.report.words.expanded_uncertainty import Expanded, expanded, factor_words, spell_factors
from rig.report.words.temperature_words import coverage_at_rows
from rig.report.words.validity_words import load_words, speed_words, when_words

ONE, ANGLE = r"\one", r"\radian"
ValuesAndStds = tuple[Sequence[float], Sequence[float], Sequence[Freedom] | None]
SOLUTION = "± U of the solution"


def gyroscope(sensor: GyroscopeEntry) -> Iterator[Element]:
    """Yield scale factors and biases with U from the budget, and with the combined covariance."""
    budget, covariance = _full_uncertainty(sensor)
    covered, (scale, bias) = coverage_sentence(budget), _widths(budget)
    model = f"{sensor.model}: true rate g, reading m, K = diag(k)."
    yield _result("scale factor", f"{model} {_speed(sensor)}{_conditions(sensor.scale_conditions)}"
                  f"{_detection_limits(sensor.detection_limits)}{covered}",
                  real_list(AXES, sensor.scale, [ONE], expanded=scale))  # fmt: skip
    yield _result("bias", f"{model} {_conditions(sensor.bias_conditions)}{covered}",
                  real_list(AXES, sensor.bias_rad_s, [RATE.d_si], expanded=bias))  # fmt: skip
    yield _joint([*sensor.scale, *sensor.bias_rad_s], covariance, budget, RATE.d_si)


def accelerometer(entry: AccelerometerEntry) -> Iterator[Element]:
    """Yield scale factors and biases relative to the stated gravity, with U and the combined covariance."""
    statement = f"{entry.model}: specific force s, reading a, k = 1/‖row of F‖, gravity {entry.gravity_m_s2!r} m/s²."
    yield from _relative(entry, [*entry.scale, *entry.bias_m_s2], ACCELERATION.d_si, statement)


def magnetometer(entry: MagnetometerEntry, reversal: ReversalEntry | None) -> Iterator[Element]:
    """Yield scale factors and biases relative to the stated field, as mounted, with U and the combined covariance.

    If the sensor was turned over, its own bias comes first.
    """
    if reversal is not None:
        yield from _reversal(reversal)
    remark = f"{entry.model}: magnetic flux density B, reading m, k = 1/‖row of F‖, field {entry.field_t!r} T."
    if entry.arm_field_in_bias:
        remark += " As mounted in this run: the bias includes the arm's field, which the uncertainty does not cover."
    yield from _relative(entry, [*entry.scale, *entry.bias_t], FIELD.d_si, remark, ", as mounted")


def further_results(characteristics: Iterable[Term]) -> Iterator[Element]:
    """Yield quantities other than scale and bias, with U from their standard deviations."""
    for term in characteristics:
        characteristic, numbers = term.characteristic, term.numbers
        remark = characteristic.remark(term.finding.entry)
        statement = f"{remark} {SOLUTION}" if remark else SOLUTION
        values = numbers.values, numbers.stds, numbers.dof
        yield _wide_result(term.name, statement, characteristic.labels, values, term.units.d_si)


def _reversal(entry: ReversalEntry) -> Iterator[Element]:
    """Yield a turned magnetometer's own bias and the arm's field, with the covariance of both."""
    mixed = [axis for axis, is_mixed in zip(AXES, entry.arm_field_in_bias, strict=True) if is_mixed]
    starts = ", ".join(run.started_utc for run in entry.runs)
    statement = f"From runs of {starts}, between which it was turned over. ± U"
    if mixed:
        statement += f" Along {', '.join(mixed)} it was not turned over: there the bias includes the arm's field."
    yield _wide_result(
        "scale factor", statement, AXES, (entry.scale, entry.scale_std, entry.scale_degrees_of_freedom), ONE
    )
    yield _wide_result(
        "own bias", statement, AXES, (entry.bias_t, entry.bias_std_t, entry.bias_degrees_of_freedom), FIELD.d_si
    )
    values = [*entry.bias_t, *entry.arm_field_t]
    counted = [*entry.bias_degrees_of_freedom, *entry.arm_field_degrees_of_freedom]
    yield _result(
        "own bias and the arm's field in the axes of the first run with their covariance",
        f"{statement} The ellipsoid holds all six values at once with a probability of 95 %.",
        real_list(
            ("bx", "by", "bz", "arm_x", "arm_y", "arm_z"),
            values,
            [FIELD.d_si],
            region=(entry.covariance, _ellipsoid_factor(counted)),
        ),
    )


def bias_drift(entry: DriftEntry, quantity: Quantity) -> Iterator[Element]:
    """Yield the bias of each repeat."""
    labels = [str(number) for number in range(1, len(entry.repeats) + 1)]
    for i, axis in enumerate(AXES):
        values, stds = zip(
            *((repeat.scale_fixed.bias[i], repeat.scale_fixed.std[i]) for repeat in entry.repeats), strict=True
        )
        remark = (
            f"Bias of the reading, scale and axes fixed; all repeats have a common standard deviation of "
            f"{entry.common_std[i]!r} {entry.unit} in addition. ± U of the differences"
        )
        dof = [entry.degrees_of_freedom[i]] * len(labels)
        yield _wide_result(f"bias along {axis} by repeat", remark, labels, (values, stds, dof), quantity.d_si)


def over_temperature(entry: OverTemperatureEntry, quantity: Quantity) -> Iterator[Element]:
    """Yield scale and bias of each axis with U, at the temperatures of the entry's table."""
    low, high = entry.range_c
    labels = [f"{row.temperature_c:.6g}_degC" for row in entry.table]
    statement = f"At temperatures of the item's own thermometer; valid from {low!r} to {high!r} °C only"
    coverage = coverage_at_rows(entry.table, entry)
    for i, axis in enumerate(AXES):
        for name, which, first, units in (("scale factor", "scale", 0, ONE), ("bias", "bias", 3, quantity.d_si)):
            values = [getattr(row, which)[i] for row in entry.table]
            widths = [getattr(row, f"expanded_{which}")[i] for row in entry.table]
            factors = coverage[:, first + i].tolist()
            stated = Expanded(widths, factors, [PROBABILITY] * len(labels))
            description = f"{statement}. ± U, {spell_factors(factors)}, about 95 %."
            yield _result(f"{name} along {axis} over temperature", description,
                          real_list(labels, values, [units], expanded=stated))  # fmt: skip


def verification(entry: VerificationEntry) -> Iterator[Element]:
    """Yield the RMS difference from a reference, as found and as left."""
    statement = f"RMS of reading minus reference {entry.reference}; includes the noise of both, without uncertainty."
    if entry.before is not None:
        yield _result("as found", statement, real_list(AXES, entry.before.movement.rms_rad_s, [RATE.d_si]))
    yield _result("as left", statement, real_list(AXES, entry.after.movement.rms_rad_s, [RATE.d_si]))


def earth_rate(entry: EarthRateEntry) -> Iterator[Element]:
    """Yield the Earth's rate with its covariance, and the resulting latitude and heading."""
    statement = "In the frame of the arm's base. The ellipsoid holds all three values with a probability of 95 %."
    factor = _ellipsoid_factor(entry.dofs(len(AXES)))
    rate = real_list(AXES, entry.rate_rad_s, [RATE.d_si], region=(entry.covariance_rad2_s2, factor))
    yield _result("Earth's rate", statement, rate)
    yield _wide_result(
        "latitude by that rate",
        SOLUTION,
        ["latitude"],
        ([entry.latitude_rad], [entry.latitude_std_rad], entry.dofs(1)),
        ANGLE,
    )
    if entry.heading_rad is not None and entry.heading_std_rad is not None:
        statement = f"Direction of the x axis of the arm's base, from north over east. {SOLUTION}"
        heading = [entry.heading_rad], [entry.heading_std_rad], entry.dofs(1)
        yield _wide_result("heading by that rate", statement, ["heading"], heading, ANGLE)


def _relative(
    entry: AccelerometerEntry | MagnetometerEntry, numbers: list[float], unit: str, statement: str, how: str = ""
) -> Iterator[Element]:
    covered, (scale, bias) = coverage_sentence(entry.budget), _widths(entry.budget)
    statement = f"{statement} {_conditions(entry.conditions)}{_detection_limits(entry.detection_limits)}{covered}"
    yield _result(f"scale factor{how}", statement, real_list(AXES, numbers[:3], [ONE], expanded=scale))
    yield _result(f"bias{how}", statement, real_list(AXES, numbers[3:], [unit], expanded=bias))
    yield _joint(numbers, entry.covariance_combined, entry.budget, unit, how)


def _full_uncertainty(entry: GyroscopeEntry) -> tuple[BudgetEntry, Matrix6]:
    """Return the budget and the combined covariance. Raise Refused `no_digital_certificate` if one is missing."""
    if entry.budget is None or entry.covariance_combined is None:
        raise Refused(
            "no_digital_certificate",
            f"only a part of the uncertainty of {entry.part} {entry.serial_number} is known",
            "Calibrate with the vector model, as `rig run` does, and a configuration of this version",
        )
    return entry.budget, entry.covariance_combined


def _conditions(when: ConditionsEntry | None) -> str:
    """Return time and temperature of the readings as a sentence; empty without `when`, as for readings of a file."""
    words = "" if when is None else f"{when_words(when)}. "
    return words[:1].upper() + words[1:]


def _detection_limits(limits: Sequence[DetectionLimitEntry]) -> str:
    """Return the detection limits as a sentence."""
    return f"Detected in 95 of 100 measurements: {list_limits(limits)}. " if limits else ""


def _speed(sensor: GyroscopeEntry) -> str:
    """Return the rates at which a gyroscope was calibrated, in words."""
    loads = load_words(sensor)
    axis_rates = "" if loads is None else f"; along the item's own axes {loads} °/s"
    return f"At {speed_words(sensor)} °/s{axis_rates}. " if sensor.speeds_rad_s else ""


def _widths(budget: BudgetEntry) -> tuple[Expanded, Expanded]:
    """Return the expanded uncertainties of the scale factors, then those of the biases."""
    columns = budget.expanded, budget.coverage_factors, budget.coverage_probabilities
    return Expanded(*(column[:3] for column in columns)), Expanded(*(column[3:] for column in columns))


def _joint(
    numbers: list[float], covariance: Sequence[Sequence[float]], budget: BudgetEntry, unit: str, how: str = ""
) -> Element:
    return _result(
        f"scale factors and biases{how} with their covariance",
        "The ellipsoid holds all six values at once with a probability of 95 %; the matrix is their covariance.",
        real_list(PARAMETERS, numbers, [ONE] * 3 + [unit] * 3, region=(covariance, joint_factor(budget))),
    )


def _ellipsoid_factor(counted: Sequence[Freedom]) -> float:
    """Return the factor of the joint coverage ellipsoid of values with these degrees of freedom (None: infinite)."""
    return find_ellipsoid_factor(len(counted), [math.inf if dof is None else dof for dof in counted])


def _wide_result(
    name: str, statement: str, labels: Sequence[str], values_and_stds: ValuesAndStds, unit: str
) -> Element:
    """Return the element of a result: values with U, computed from standard deviations and degrees of freedom."""
    numbers, stds, dof = values_and_stds
    words = f"{statement}, {factor_words(dof)}."
    return _result(name, words, real_list(labels, numbers, [unit], expanded=expanded(stds, dof)))


def _result(name: str, statement: str, quantity: Element) -> Element:
    return dcc("result", text("name", name), text("description", statement), dcc("data", dcc("quantity", quantity)))
