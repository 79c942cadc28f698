"""Gyroscopes: scale, bias, axes and g-sensitivity from whole turns (SIX, TRIAX)."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.budget import expanded_uncertainties
from rig.data.entries.external import AttitudesEntry
from rig.data.entries.result_types import ErrorEntry, Role
from rig.data.quantity import RATE
from rig.data.result_file import BoardEntry, EstimateEntry, GyroscopeEntry, ResultDocument, TimeBaseEntry, VectorEntry
from rig.estimation.arrays import divide_or_infinity
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.report.c_code.c_functions import gyroscope_lines
from rig.report.entries.by_hand import by_hand_lines
from rig.report.entries.earth_rate import earth_rate_lines
from rig.report.findings.characteristics import GYROSCOPES, NON_ORTHOGONALITY
from rig.report.findings.corrected import Corrected, noise_of
from rig.report.findings.finding import Finding
from rig.report.findings.kind import Measured, ResultKind, Shown, Without
from rig.report.findings.unexplained import of_sweeps_and_rests
from rig.report.kinds.triad import followed_of, item_words, shown_of, tables, unsolved_lines
from rig.report.tables import dcc_results
from rig.report.tables.axes import decimals, line_of, matrix_lines, triple
from rig.report.words.told_words import told_from, told_lines
from rig.report.words.validity_words import load_words, speed_words, warmth, when_words


def _entries(outcome: Outcome) -> dict[str, GyroscopeEntry]:
    """The entry is there of every run, empty where no sweeps were made."""
    from rig.analysis.read_when import of_gyroscope
    from rig.report.entries.external import rates_in_attitudes, turned
    from rig.report.entries.gyroscope import sensor_entry
    from rig.report.entries.when import when_entry

    made = {}
    for name, result in outcome.results.items():
        role: Role = "calibrate" if name in outcome.settings.to_calibrate else "reference"
        if (elsewhere := outcome.elsewhere.get(name)) is not None:
            made[name] = sensor_entry(
                result, role, in_attitudes=rates_in_attitudes(elsewhere), by_angles=turned(elsewhere)
            )
            continue
        if outcome.settings.by_hand is not None:
            made[name] = sensor_entry(result, role)
            continue
        held, agreed = of_gyroscope(outcome.recordings, name), outcome.onboard.get(name)
        made[name] = sensor_entry(
            result,
            role,
            agreed,
            scale_conditions=when_entry(held.scale),
            bias_conditions=when_entry(held.bias),
            **told_from(outcome.told_from.get(name, ())),
        )
    return made


def _found(document: ResultDocument) -> Iterator[Finding[GyroscopeEntry]]:
    return (Finding(name, RATE, entry) for name, entry in document.gyroscopes.items())


def _printed(finding: Finding[GyroscopeEntry]) -> Iterator[Table | str]:
    sensor, reference = finding.entry, " (known)" if finding.known else ""
    title = f"{finding.sensor}{reference}: {item_words(sensor)}, {sensor.model}, {sensor.estimator}"
    yield from tables(title, RATE, sensor)
    yield from _beside(finding)


def _shown(finding: Finding[GyroscopeEntry]) -> Shown:
    speeds = speed_words(finding.entry)
    held_at = f"at {speeds} °/s" if speeds else ""
    return replace(shown_of(finding), held_at=held_at, model=finding.entry.model)


def _measured(finding: Finding[GyroscopeEntry], _: object) -> Measured | None:
    """The item's results; nothing of a reference."""
    sensor = finding.entry
    if finding.known:
        return None
    name = f"calibration of gyroscope {finding.sensor}"
    results, warm = dcc_results.gyroscope(sensor), temperatures_c(sensor)
    return Measured("gyroscope", finding.sensor, sensor.part, sensor.serial_number, name, results, warm)


def _corrected(finding: Finding[GyroscopeEntry]) -> Corrected | None:
    """Readings to rates, in the frame nearest to its axes."""
    sensor = finding.entry
    if finding.known:
        return None
    matrix, sensitivity = np.diag(1 / np.array(sensor.scale)), None
    if isinstance(vector := sensor.vector_model, VectorEntry):
        to_sensor = np.array(vector.mounting)
        matrix = np.array(vector.matrix) @ to_sensor.T
        if vector.g_sensitivity_rad_s_per_m_s2 is not None:  # of gravity, which points down where force points up
            sensitivity = -np.array(vector.g_sensitivity_rad_s_per_m_s2) @ to_sensor.T
    return Corrected(
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
    )


def temperatures_c(sensor: GyroscopeEntry) -> dict[str, float | None]:
    """How warm a gyroscope was, by what of it was read then: scale factors come from the sweeps alone."""
    if sensor.scale_conditions is None or sensor.bias_conditions is None:
        return {"": sensor.temperature_c}
    return warmth(sensor.scale_conditions, " at the scale factors") | warmth(sensor.bias_conditions, " at the biases")


def _beside(finding: Finding[GyroscopeEntry]) -> Iterator[str]:
    """What stands beside a gyroscope's values: speeds, the other estimators, what the vector model says of the axes."""
    sensor = finding.entry
    yield from _speeds(sensor)
    if sensor.scale_conditions is not None and sensor.bias_conditions is not None:
        yield f"scale: {when_words(sensor.scale_conditions)}"
        yield f"bias: {when_words(sensor.bias_conditions)}"
    yield from told_lines(sensor.detection_limits)
    yield from _in_attitudes(sensor.in_attitudes, sensor.time_bases)
    yield from _turned(sensor)
    if sensor.by_hand is not None:
        yield from by_hand_lines(sensor.by_hand)
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
            yield from _differs(sensor, other)
    if sensor.board is not None:
        yield from _on_the_board(sensor.board)
    if not isinstance(vector, ErrorEntry):
        if sensor.range_rad_s is None and sensor.budget is not None:  # of readings from elsewhere F is what is wanted
            covariance = np.array(vector.matrix_covariance)[:9, :9]
            yield from matrix_lines(np.array(vector.matrix), covariance, max(sensor.budget.coverage_factors[:3]))
        else:
            yield line_of(NON_ORTHOGONALITY.of(finding), "non-orthogonality yz zx xy", "+.3f")
        yield from (f"warning: {warning}" for warning in vector.warnings)


def _differs(sensor: GyroscopeEntry, other: EstimateEntry | VectorEntry) -> Iterator[str]:
    """Which of two estimators to believe, where they differ by more than U."""
    expanded = expanded_uncertainties(sensor.budget, sensor.covariance)
    values, others = ((*each.scale, *each.bias_rad_s) for each in (sensor, other))
    off = divide_or_infinity(np.abs(np.subtract(others, values)), expanded)
    worst = int(np.argmax(off))
    if off[worst] > 1 and sensor.estimator == "vector":
        yield (
            f"  {PARAMETERS[worst]} differs by {off[worst]:.1f} U: believe the values of the table; this method knows "
            "the speed alone, and leaves out gravity, the Earth's rate and how the axes lie"
        )


def _turned(sensor: GyroscopeEntry) -> Iterator[str]:
    """How sweeps of a file were read, and what was taken as known of them."""
    if (found := sensor.by_angles) is None:
        if sensor.range_rad_s is None and sensor.in_attitudes is None and sensor.by_hand is None:
            yield "the axes of the sweeps are taken as given: an error of theirs is an error of F across its rows"
        return
    rows, sweeps = ", ".join(map(str, found.rows)), len(sensor.observations)
    yield f"by the angle turned from rest to rest: {len(found.rows)} of {sweeps} sweeps (rows {rows})"
    yield (
        f"a turn ends within {1e3 * found.angle_std_rad:.1f} mrad of what is said of it, its axis leans by "
        f"{1e3 * found.axis_std_rad:.0f} mrad (one standard deviation: angle_std_rad, axis_std_rad)"
    )
    if found.uncertainty_inflation > 1:
        inflation = f"{found.uncertainty_inflation:.2g}"
        yield f"the rotations contradict each other by more, and count as {inflation} times as uncertain"


def _in_attitudes(attitudes: AttitudesEntry | None, clocks: Iterable[TimeBaseEntry]) -> Iterator[str]:
    """What attitudes of a file told beside scale and bias."""
    if attitudes is None:
        return
    for clock in clocks:
        yield (
            f"the samples' clock on the table's: {clock.offset_s:+.4f} s (± {2e3 * clock.offset_std_s:.2g} ms), "
            f"{1e6 * clock.drift:+.1f} ppm (± {2e6 * clock.drift_std:.2g}) at {clock.reference_board_s:.1f} s of theirs"
        )
    if attitudes.earth_rate_rad_s is None or attitudes.earth_rate_std_rad_s is None:
        yield f"Earth's rate: {attitudes.earth_rate_error}; its size, whichever way it points, is in the uncertainty"
    else:
        rate, known = triple(attitudes.earth_rate_rad_s, "+.3e"), 2 * max(attitudes.earth_rate_std_rad_s)
        yield f"Earth's rate in table coordinates: {rate} rad/s (± {known:.1e}, k = 2)"
    if (way := attitudes.by_increments) is not None:
        yield (
            f"increments: {way.increments} between attitudes, means over windows of {way.window_s:.3g} s; residuals "
            f"{1e3 * way.residual_rms_rad:.3g} mrad"
        )
        yield (
            f"found beside: attitudes off by {1e3 * way.attitude_std_rad:.2g} mrad a window, angle random walk "
            f"{way.angle_random_walk_rad_sqrt_s:.2g} rad/√s; from one stretch of the recording to another F differs by "
            f"{way.matrix_scatter:.1e}, b by {way.bias_scatter_rad_s:.1e} rad/s"
        )
        late_ms, known_ms = 1e3 * way.clock_offset_s, 2e3 * way.clock_offset_std_s
        yield f"the attitudes' clock is {late_ms:+.2f} ± {known_ms:.2g} ms off the samples', which is allowed for"
    for method, other in attitudes.other_methods.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}: {other.error}"
        else:
            yield f"{method}: k {triple(other.scale, '.6g')}, b {triple(other.bias_rad_s, '+.6g')} rad/s"


def _speeds(sensor: GyroscopeEntry) -> Iterator[str]:
    """Where a calibration is valid, in words: one speed does not tell how far the sensor is from linear."""
    speeds, loads, found = speed_words(sensor), load_words(sensor), sensor.nonlinearity
    if loads is not None:
        yield f"along its own axes the sweeps turned it by {loads} °/s"
    if found is None:
        yield from [f"the scale factors are those at {speeds} °/s"] if speeds else []
        return
    for name, values, std in (
        ("odd", found.odd_per_rad_s, found.odd_std_per_rad_s),
        ("even", found.even_per_rad_s, found.even_std_per_rad_s),
    ):
        percent = triple(np.multiply(100, values), "+.4f")
        yield f"nonlinearity, {name}: {percent} % per rad/s (± {200 * max(std):.4f}, k = 2), from {speeds} °/s"


def _on_the_board(board: BoardEntry) -> Iterator[str]:
    """The board's solution, or why it has none."""
    found = board.solutions.get("closed_form")
    if found is None:
        yield "on the board: nothing was solved"
    elif found.status == "solved":
        yield f"on the board: k {triple(found.scale, '.5f')}, b {triple(found.bias_rad_s, '+.5f')} rad/s"
    else:
        yield f"on the board: {found.status}, from {found.observations} sweeps"
    yield from (f"not observed by the board: {sweep}" for sweep in board.not_observed)


GYROSCOPE = ResultKind(
    name="gyroscope",
    key="gyroscopes",
    entries=_entries,
    found=_found,
    printed=_printed,
    shown=_shown,
    followed=followed_of,
    header=gyroscope_lines,
    unsolved=lambda document: unsolved_lines(document, RATE),
    figures=Without("its residuals are on the certificate and in the notebook"),
    block="gyroscope.html.j2:gyroscope",
    measured=_measured,
    corrected=_corrected,
    unexplained=of_sweeps_and_rests,
    characteristics=GYROSCOPES,
    standard=Without("its standards are time and angle, of which every certificate speaks"),
)
