"""Gyroscopes: scale, bias, axes and g-sensitivity from whole turns (papers SIX and TRIAX)."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.budget import expand_uncertainties
from rig.data.entries.external import AttitudesEntry
from rig.data.entries.result_types import ErrorEntry, Role
from rig.data.quantity import RATE
from rig.data.result_file import BoardEntry, EstimateEntry, GyroscopeEntry, TimeBaseEntry, VectorEntry
from rig.estimation.arrays import divide_or_infinity
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.report.c_code.c_functions import gyroscope_lines
from rig.report.entries.by_hand import hand_lines
from rig.report.entries.earth_rate import earth_rate_lines
from rig.report.findings.characteristics import GYROSCOPES, NON_ORTHOGONALITY
from rig.report.findings.finding import Finding
from rig.report.findings.linear_corrections import SensorCorrection, noise_of
from rig.report.findings.result_kind import CertifiedItem, DisplayRow, NoOutlet, ResultKind
from rig.report.findings.unexplained import find_sweep_residuals
from rig.report.kinds.triad import describe_unsolved, history_record, item_words, shown_of, tables
from rig.report.tables import dcc_results
from rig.report.tables.axis_tables import decimals, line_of, matrix_lines, triple
from rig.report.words.detection_limit_words import detection_limit_field, detection_limit_lines
from rig.report.words.validity_words import load_words, speed_words, warmth, when_words


def _entries(outcome: Outcome) -> dict[str, GyroscopeEntry]:
    """Return the entries of all gyroscopes, if any."""
    from rig.analysis.measurement_conditions import gyroscope_conditions
    from rig.report.entries.gyroscope import sensor_entry
    from rig.report.entry import when_entry

    entries = {}
    for name, result in outcome.results.items():
        role: Role = "calibrate" if name in outcome.settings.to_calibrate else "reference"
        if (external := outcome.external.get(name)) is not None:
            from rig.report.entries.external import angles_entry, rates_in_attitudes

            entries[name] = sensor_entry(
                result, role, in_attitudes=rates_in_attitudes(external), by_angles=angles_entry(external)
            )
            continue
        if outcome.settings.by_hand is not None:
            entries[name] = sensor_entry(result, role)
            continue
        conditions, board = gyroscope_conditions(outcome.recordings, name), outcome.onboard.get(name)
        entries[name] = sensor_entry(
            result,
            role,
            board,
            scale_conditions=when_entry(conditions.scale),
            bias_conditions=when_entry(conditions.bias),
            **detection_limit_field(outcome.detection_limits.get(name, ())),
        )
    return entries


def _render(finding: Finding[GyroscopeEntry]) -> Iterator[Table | str]:
    sensor, reference = finding.entry, " (known)" if finding.is_reference else ""
    title = f"{finding.sensor}{reference}: {item_words(sensor)}, {sensor.model}, {sensor.estimator}"
    yield from tables(title, RATE, sensor)
    yield from _lines(finding)


def _build_row(finding: Finding[GyroscopeEntry]) -> DisplayRow:
    speeds = speed_words(finding.entry)
    held_at = f"at {speeds} °/s" if speeds else ""
    return replace(shown_of(finding), held_at=held_at, model=finding.entry.model)


def _describe_item(finding: Finding[GyroscopeEntry], _: object) -> CertifiedItem | None:
    """Return the item with its results; None for a reference."""
    sensor = finding.entry
    if finding.is_reference:
        return None
    name = f"calibration of gyroscope {finding.sensor}"
    results, temperatures = dcc_results.gyroscope(sensor), temperatures_c(sensor)
    return CertifiedItem("gyroscope", finding.sensor, sensor.part, sensor.serial_number, name, results, temperatures)


def _build_correction(finding: Finding[GyroscopeEntry]) -> SensorCorrection | None:
    """Return the correction of readings to rates, in the frame nearest to the sensor's axes; None for a reference."""
    sensor = finding.entry
    if finding.is_reference:
        return None
    matrix, sensitivity, to_sensor = np.diag(1 / np.array(sensor.scale)), None, None
    if isinstance(vector := sensor.vector_model, VectorEntry):
        to_sensor = np.array(vector.mounting)
        matrix = np.array(vector.matrix) @ to_sensor.T
        if vector.g_sensitivity_rad_s_per_m_s2 is not None:  # gravity points down, force at rest up
            sensitivity = -np.array(vector.g_sensitivity_rad_s_per_m_s2) @ to_sensor.T
    return SensorCorrection(
        sensor=finding.sensor,
        quantity=RATE,
        part=sensor.part,
        serial_number=sensor.serial_number,
        full_scale=sensor.range_rad_s,
        temperature_c=sensor.temperature_c,
        scale=np.array(sensor.scale),
        matrix=matrix,
        offset=-np.array(sensor.bias_rad_s),
        noise=noise_of(sensor.observations, [(rest.noise_rad_s, rest.samples) for rest in sensor.rests]),
        g_sensitivity=sensitivity,
        mounting=to_sensor,
    )


def temperatures_c(sensor: GyroscopeEntry) -> dict[str, float | None]:
    """Return the temperatures to which a gyroscope's values refer: one, or one for scale factors and one for biases."""
    if sensor.scale_conditions is None or sensor.bias_conditions is None:
        return {"": sensor.temperature_c}
    return warmth(sensor.scale_conditions, " at the scale factors") | warmth(sensor.bias_conditions, " at the biases")


def _lines(finding: Finding[GyroscopeEntry]) -> Iterator[str]:
    """Yield the lines below a gyroscope's table: speeds, other estimators, and the axes by the vector model."""
    sensor = finding.entry
    yield from _speeds(sensor)
    if sensor.scale_conditions is not None and sensor.bias_conditions is not None:
        yield f"scale: {when_words(sensor.scale_conditions)}"
        yield f"bias: {when_words(sensor.bias_conditions)}"
    yield from detection_limit_lines(sensor.detection_limits)
    yield from _attitude_lines(sensor.in_attitudes, sensor.time_bases)
    yield from _angle_lines(sensor)
    if sensor.by_hand is not None:
        yield from hand_lines(sensor.by_hand)
    yield from earth_rate_lines(sensor.earth_rate)
    vector = sensor.vector_model
    std = [sensor.covariance[i][i] ** 0.5 for i in range(6)]
    scale, bias = f".{decimals(std[:3])}f", f"+.{decimals(std[3:])}f"
    others = {"vector_model": vector, "six_observation": sensor.six_observation, "algorithm_1": sensor.algorithm_1}
    for name, other in others.items() if sensor.in_attitudes is None and sensor.by_hand is None else ():
        if isinstance(other, ErrorEntry):
            yield f"{name}: {other.error}"
        elif other.estimator != sensor.estimator:
            yield f"{name}: k {triple(other.scale, scale)}, b {triple(other.bias_rad_s, bias)} rad/s"
            yield from _describe_difference(sensor, other)
    if sensor.board is not None:
        yield from _board_lines(sensor.board)
    if not isinstance(vector, ErrorEntry):
        if sensor.range_rad_s is None and sensor.budget is not None:  # external readings: users need F
            covariance = np.array(vector.matrix_covariance)[:9, :9]
            yield from matrix_lines(np.array(vector.matrix), covariance, max(sensor.budget.coverage_factors[:3]))
        else:
            yield line_of(NON_ORTHOGONALITY.term_of(finding), "non-orthogonality yz zx xy", "+.3f")
        yield from (f"warning: {warning}" for warning in vector.warnings)


def _describe_difference(sensor: GyroscopeEntry, other: EstimateEntry | VectorEntry) -> Iterator[str]:
    """Yield a sentence if an `other` method's result differs by more than U from that of the vector model."""
    expanded = expand_uncertainties(sensor.budget, sensor.covariance)
    values, others = ((*solution.scale, *solution.bias_rad_s) for solution in (sensor, other))
    differences = divide_or_infinity(np.abs(np.subtract(others, values)), expanded)
    worst = int(np.argmax(differences))
    off_by = float(differences[worst])
    if off_by > 1 and sensor.estimator == "vector":
        yield (
            f"  {PARAMETERS[worst]} differs by {off_by:.1f} U: use the values of the table; this method uses "
            "the speed alone and ignores gravity, the Earth's rate and the directions of the axes"
        )


def _angle_lines(sensor: GyroscopeEntry) -> Iterator[str]:
    """Yield lines on the interpretation of a file's sweeps, and on the errors assumed for their turns."""
    if (angles := sensor.by_angles) is None:
        if sensor.range_rad_s is None and sensor.in_attitudes is None and sensor.by_hand is None:
            yield "the axes of the sweeps are assumed exact: an error of theirs is an error of F across its rows"
        return
    rows, sweeps = ", ".join(map(str, angles.rows)), len(sensor.observations)
    yield f"by the angle turned from rest to rest: {len(angles.rows)} of {sweeps} sweeps (rows {rows})"
    yield (
        f"assumed errors of a turn: {1e3 * angles.angle_std_rad:.1f} mrad of its angle and "
        f"{1e3 * angles.axis_std_rad:.0f} mrad of its axis (one standard deviation: angle_std_rad, axis_std_rad)"
    )
    if angles.uncertainty_inflation > 1:
        inflation = f"{angles.uncertainty_inflation:.2g}"
        yield f"the rotations contradict each other by more; their uncertainties are multiplied by {inflation}"


def _attitude_lines(attitudes: AttitudesEntry | None, clocks: Iterable[TimeBaseEntry]) -> Iterator[str]:
    """Yield lines on the results, other than scale and bias, from a file's attitudes."""
    if attitudes is None:
        return
    for clock in clocks:
        yield (
            f"the samples' clock on the table's: {clock.offset_s:+.4f} s (± {2e3 * clock.offset_std_s:.2g} ms), "
            f"{1e6 * clock.drift:+.1f} ppm (± {2e6 * clock.drift_std:.2g}) at {clock.reference_board_s:.1f} s of theirs"
        )
    if attitudes.earth_rate_rad_s is None or attitudes.earth_rate_std_rad_s is None:
        yield f"Earth's rate: {attitudes.earth_rate_error} Its size, in any direction, is in the uncertainty"
    else:
        rate, expanded = triple(attitudes.earth_rate_rad_s, "+.3e"), 2 * max(attitudes.earth_rate_std_rad_s)
        yield f"Earth's rate in table coordinates: {rate} rad/s (± {expanded:.1e}, k = 2)"
    if (increments := attitudes.by_increments) is not None:
        yield (
            f"increments: {increments.increments} between attitudes, means over {increments.window_s:.3g} s; "
            f"residuals {1e3 * increments.residual_rms_rad:.3g} mrad"
        )
        yield (
            f"also estimated: attitude error {1e3 * increments.attitude_std_rad:.2g} mrad a window, angle random walk "
            f"{increments.angle_random_walk_rad_sqrt_s:.2g} rad/√s; between intervals of the recording F differs by "
            f"{increments.matrix_scatter:.1e}, b by {increments.bias_scatter_rad_s:.1e} rad/s"
        )
        offset_ms, expanded_ms = 1e3 * increments.clock_offset_s, 2e3 * increments.clock_offset_std_s
        yield f"the attitudes' clock is {offset_ms:+.2f} ± {expanded_ms:.2g} ms from the samples' (corrected)"
        yield (
            "U contains inclinations of the axes about which the reference turns, as far as the motion does not show "
            "them: those of an arm whose joint zeros are off. Moves of several joints at once reduce this part"
        )
    for method, other in attitudes.other_methods.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}: {other.error}"
        else:
            yield f"{method}: k {triple(other.scale, '.6g')}, b {triple(other.bias_rad_s, '+.6g')} rad/s"


def _speeds(sensor: GyroscopeEntry) -> Iterator[str]:
    """Yield lines on the speeds for which the calibration is valid, and on nonlinearity if several speeds show it."""
    speeds, loads, nonlinearity = speed_words(sensor), load_words(sensor), sensor.nonlinearity
    if loads is not None:
        yield f"rates along its own axes: {loads} °/s"
    if nonlinearity is None:
        yield from [f"the scale factors apply at {speeds} °/s"] if speeds else []
        return
    for name, values, std in (
        ("odd", nonlinearity.odd_per_rad_s, nonlinearity.odd_std_per_rad_s),
        ("even", nonlinearity.even_per_rad_s, nonlinearity.even_std_per_rad_s),
    ):
        percent = triple(np.multiply(100, values), "+.4f")
        yield f"nonlinearity, {name}: {percent} % per rad/s (± {200 * max(std):.4f}, k = 2), from {speeds} °/s"


def _board_lines(board: BoardEntry) -> Iterator[str]:
    """Yield lines on the board's own solution, or the reason why it has none."""
    solution = board.solutions.get("closed_form")
    if solution is None:
        yield "on the board: nothing was solved"
    elif solution.status == "solved":
        yield f"on the board: k {triple(solution.scale, '.5f')}, b {triple(solution.bias_rad_s, '+.5f')} rad/s"
    else:
        yield f"on the board: {solution.status}, from {solution.observations} sweeps"
    yield from (f"not observed by the board: {sweep}" for sweep in board.not_observed)


GYROSCOPE = ResultKind(
    name="gyroscope",
    key="gyroscopes",
    entries=_entries,
    find=lambda document: (Finding(name, RATE, entry) for name, entry in document.gyroscopes.items()),
    printed=_render,
    shown=_build_row,
    followed=history_record,
    header=gyroscope_lines,
    unsolved=lambda document: describe_unsolved(document, RATE),
    figures=NoOutlet("its residuals are on the certificate and in the notebook"),
    block="gyroscope.html.j2:gyroscope",
    measured=_describe_item,
    corrected=_build_correction,
    unexplained=find_sweep_residuals,
    characteristics=GYROSCOPES,
    standard=NoOutlet("its standards are time and angle, which every certificate states"),
)
