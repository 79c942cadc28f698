"""The results of a digital certificate: values in full, with U or with their covariance, quantity by quantity."""

from collections.abc import Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.drift import DriftEntry
from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import ConditionsEntry, DetectionLimitEntry, Freedom, Matrix6
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.result_file import GyroscopeEntry, VerificationEntry
from rig.errors import Refused
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, PROBABILITY
from rig.report.findings.characteristic import Term
from rig.report.tables.certificate import AXES, JOINT_FACTOR
from rig.report.tables.coverage import coverage_sentence
from rig.report.tables.xml_parts import dcc, real_list, text
from rig.report.words.expanded import Expanded, expanded, factor_words
from rig.report.words.told_words import told_words
from rig.report.words.validity_words import load_words, speed_words, when_words

ONE, ANGLE = r"\one", r"\radian"
Known = tuple[Sequence[float], Sequence[float], Sequence[Freedom] | None]
# Of three values at once: √χ² of three degrees of freedom at 95 %.
JOINT_FACTOR_3 = 2.795
SOLUTION = "± U of the solution"


def gyroscope(sensor: GyroscopeEntry) -> Iterator[Element]:
    """Scale factors and biases with U of the budget, and with the combined covariance; what else was found of it."""
    budget, covariance = _known_whole(sensor)
    covered, (scale, bias) = coverage_sentence(budget), _expanded(budget)
    model = f"{sensor.model}: true rate g, reading m, K = diag(k)."
    yield _result("scale factor", f"{model} {_speed(sensor)}{_at(sensor.scale_conditions)}"
                  f"{_told(sensor.detection_limits)}{covered}",
                  real_list(AXES, sensor.scale, [ONE], expanded=scale))  # fmt: skip
    yield _result("bias", f"{model} {_at(sensor.bias_conditions)}{covered}",
                  real_list(AXES, sensor.bias_rad_s, [RATE.d_si], expanded=bias))  # fmt: skip
    yield _joint([*sensor.scale, *sensor.bias_rad_s], covariance, RATE.d_si)


def accelerometer(entry: AccelerometerEntry) -> Iterator[Element]:
    """Relative to the stated gravity, with U of the budget and the combined covariance."""
    said = f"{entry.model}: specific force s, reading a, k = 1/‖row of F‖, gravity {entry.gravity_m_s2!r} m/s²."
    yield from _relative(entry, [*entry.scale, *entry.bias_m_s2], ACCELERATION.d_si, said)


def magnetometer(entry: MagnetometerEntry, turned: ReversalEntry | None) -> Iterator[Element]:
    """Relative to the stated field, as mounted, with U of the budget and the combined covariance.

    First, of a sensor that was turned over, its own bias.
    """
    if turned is not None:
        yield from _reversed(turned)
    said = f"{entry.model}: magnetic flux density B, reading m, k = 1/‖row of F‖, for a field of {entry.field_t!r} T."
    if entry.arm_field_in_bias:
        said += " As mounted in this run: the field of the arm is in the bias, and the uncertainty does not cover it."
    yield from _relative(entry, [*entry.scale, *entry.bias_t], FIELD.d_si, said, ", as mounted")


def beside(characteristics: Iterable[Term]) -> Iterator[Element]:
    """What was found of a sensor beside scale and bias, with U by its standard deviations."""
    for each in characteristics:
        of, known = each.characteristic, each.known
        said = f"{remark} {SOLUTION}" if (remark := of.remark(each.finding.entry)) else SOLUTION
        yield _spread(each.name, said, of.labels, (known.values, known.stds, known.freedom), each.units.d_si)


def _reversed(entry: ReversalEntry) -> Iterator[Element]:
    """A turned magnetometer's own bias and the arm's field, with the covariance of both."""
    mixed = [axis for axis, held in zip(AXES, entry.arm_field_in_bias, strict=True) if held]
    began = ", ".join(run.started_utc for run in entry.runs)
    said = f"From runs of {began}, between which it was turned over. ± U"
    if mixed:
        said += f" Along {', '.join(mixed)} it was never turned over: there the arm's field is in the bias."
    yield _spread("scale factor", said, AXES, (entry.scale, entry.scale_std, entry.scale_degrees_of_freedom), ONE)
    yield _spread("own bias", said, AXES, (entry.bias_t, entry.bias_std_t, entry.bias_degrees_of_freedom), FIELD.d_si)
    names = ("bx", "by", "bz", "arm x", "arm y", "arm z")
    values = [*entry.bias_t, *entry.arm_field_t]
    yield _result(
        "own bias and the arm's field in the axes of the first run with their covariance",
        f"{said} The ellipsoid holds all six values at once with a probability of 95 %.",
        real_list(
            [name.replace(" ", "_") for name in names], values, [FIELD.d_si], region=(entry.covariance, JOINT_FACTOR)
        ),
    )


def bias_drift(entry: DriftEntry, of: Quantity) -> Iterator[Element]:
    """The bias of each repeat."""
    labels = [str(number) for number in range(1, len(entry.repeats) + 1)]
    for i, axis in enumerate(AXES):
        values, stds = zip(
            *((each.scale_fixed.bias[i], each.scale_fixed.std[i]) for each in entry.repeats), strict=True
        )
        said = f"What the reading adds, scale and axes held; beside what differs between repeats all share a standard \
deviation of {entry.common_std[i]!r} {entry.unit}. ± U of what differs"
        freedom = [entry.degrees_of_freedom[i]] * len(labels)
        yield _spread(f"bias along {axis} by repeat", said, labels, (values, stds, freedom), of.d_si)


def over_temperature(entry: OverTemperatureEntry, of: Quantity) -> Iterator[Element]:
    """Scale and bias of each axis at the temperatures of the table, with U."""
    low, high = entry.range_c
    labels = [f"{row.temperature_c:.6g}_degC" for row in entry.table]
    held = f"At temperatures of the item's own thermometer; holds from {low!r} to {high!r} °C only"
    for i, axis in enumerate(AXES):
        for name, which, units in (("scale factor", "scale", ONE), ("bias", "bias", of.d_si)):
            values = [getattr(row, which)[i] for row in entry.table]
            widths = [getattr(row, f"expanded_{which}")[i] for row in entry.table]
            stated = Expanded(widths, *([each] * len(labels) for each in (COVERAGE_FACTOR, PROBABILITY)))
            yield _result(f"{name} along {axis} over temperature", f"{held}. ± U, about 95 %.",
                          real_list(labels, values, [units], expanded=stated))  # fmt: skip


def verification(entry: VerificationEntry) -> Iterator[Element]:
    """RMS against a reference, as found and as left."""
    said = f"RMS of reading less reference {entry.reference}; holds the noise of both, no uncertainty was evaluated."
    if entry.before is not None:
        yield _result("as found", said, real_list(AXES, entry.before.movement.rms_rad_s, [RATE.d_si]))
    yield _result("as left", said, real_list(AXES, entry.after.movement.rms_rad_s, [RATE.d_si]))


def earth_rate(entry: EarthRateEntry) -> Iterator[Element]:
    """The rate with its covariance, and the place by that rate."""
    said = "As found in the frame of the arm's base. The ellipsoid holds all three values with a probability of 95 %."
    rate = real_list(AXES, entry.rate_rad_s, [RATE.d_si], region=(entry.covariance_rad2_s2, JOINT_FACTOR_3))
    yield _result("Earth's rate", said, rate)
    yield _spread(
        "latitude by that rate",
        SOLUTION,
        ["latitude"],
        ([entry.latitude_rad], [entry.latitude_std_rad], entry.freedoms(1)),
        ANGLE,
    )
    if entry.heading_rad is not None and entry.heading_std_rad is not None:
        said = f"Where the x axis of the arm's base points, from north over east. {SOLUTION}"
        heading = [entry.heading_rad], [entry.heading_std_rad], entry.freedoms(1)
        yield _spread("heading by that rate", said, ["heading"], heading, ANGLE)


def _relative(
    entry: AccelerometerEntry | MagnetometerEntry, numbers: list[float], unit: str, statement: str, how: str = ""
) -> Iterator[Element]:
    covered, (scale, bias) = coverage_sentence(entry.budget), _expanded(entry.budget)
    statement = f"{statement} {_at(entry.conditions)}{_told(entry.detection_limits)}{covered}"
    yield _result(f"scale factor{how}", statement, real_list(AXES, numbers[:3], [ONE], expanded=scale))
    yield _result(f"bias{how}", statement, real_list(AXES, numbers[3:], [unit], expanded=bias))
    yield _joint(numbers, entry.covariance_combined, unit, how)


def _known_whole(entry: GyroscopeEntry) -> tuple[BudgetEntry, Matrix6]:
    """The budget and the covariance that combines it. Raises Refused `no_digital_certificate` where one is missing."""
    if entry.budget is None or entry.covariance_combined is None:
        raise Refused(
            "no_digital_certificate",
            f"only a part of the uncertainty of {entry.part} {entry.serial_number} is known",
            "Calibrate with the vector model, as `rig run` does, and a configuration of this version",
        )
    return entry.budget, entry.covariance_combined


def _at(when: ConditionsEntry | None) -> str:
    """When it was read, and how warm it was; nothing of readings of a file, whose times nobody knows."""
    words = "" if when is None else f"{when_words(when)}. "
    return words[:1].upper() + words[1:]


def _told(damages: Sequence[DetectionLimitEntry]) -> str:
    """What would have contradicted itself."""
    return f"Told in 95 of 100 measurements: {told_words(damages)}. " if damages else ""


def _speed(sensor: GyroscopeEntry) -> str:
    """The rates at which a gyroscope was calibrated, in words."""
    loads = load_words(sensor)
    along = "" if loads is None else f"; along the item's own axes the sweeps turned it by {loads} °/s"
    return f"At {speed_words(sensor)} °/s{along}. " if sensor.speeds_rad_s else ""


def _expanded(budget: BudgetEntry) -> tuple[Expanded, Expanded]:
    """The expanded uncertainties of scale factors and of biases."""
    of = budget.expanded, budget.coverage_factors, budget.coverage_probabilities
    return Expanded(*(each[:3] for each in of)), Expanded(*(each[3:] for each in of))


def _joint(numbers: list[float], covariance: Sequence[Sequence[float]], unit: str, how: str = "") -> Element:
    return _result(
        f"scale factors and biases{how} with their covariance",
        "The ellipsoid holds all six values at once with a probability of 95 %; the matrix is their covariance.",
        real_list(PARAMETERS, numbers, [ONE] * 3 + [unit] * 3, region=(covariance, JOINT_FACTOR)),
    )


def _spread(name: str, statement: str, labels: Sequence[str], known: Known, unit: str) -> Element:
    """Values with U, from these, their standard deviations and the degrees of freedom."""
    numbers, stds, freedom = known
    words = f"{statement}, {factor_words(freedom)}."
    return _result(name, words, real_list(labels, numbers, [unit], expanded=expanded(stds, freedom)))


def _result(name: str, statement: str, quantity: Element) -> Element:
    return dcc("result", text("name", name), text("description", statement), dcc("data", dcc("quantity", quantity)))
