"""The checks of a gyroscope's recording against itself: segments of sweeps and rests against one model.

One calibration must explain all segments within noise, bias random walk and the known errors of arm and sensor. It is
the vector model with gravity a and a steady bias drift d:

    m = F ω + c + G a + d t

Each check tests the columns of one fault. Without the fault, the χ² that the columns explain has as many degrees of
freedom as there are columns. The bias process is estimated from residuals within sweeps and between rests, so that a
disturbed sweep does not mask itself.

Transfers, the motions between sweeps, are segments too. A ripple of the arm's rate that is faster than the samples and
states may shift the mean reading of a transfer, although the recorded states do not show it. So a model is fitted whose
parameters may change from quarter to quarter of the recording, and the variance of the transfers is increased until it
agrees with the residuals of that model. A transfer that still is an outlier gets a mean of its own, so that it does not
affect the tests.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.analysis.consistency.alternatives import (
    FAULT_MODES,
    Means,
    changes,
    differences,
    normalise_time,
    quarter_columns,
    repeat_per_axis,
    single_axis_columns,
    step_columns,
    sweep_columns,
)
from rig.analysis.consistency.residual_tests import (
    CHI_SQUARE_MARGIN,
    Alternative,
    Statistic,
    TestResults,
    chi_square_of,
    find_outliers,
    orthonormal_basis,
    remaining_directions,
    test_alternatives,
)
from rig.analysis.consistency.whitened_segments import (
    Scatter,
    WhitenedSegments,
    apply_whitener,
    build_whitener,
    critical_value,
    whiten_segments,
)
from rig.analysis.gyroscope.segment_table import Segments
from rig.estimation.arrays import Array, distinct
from rig.estimation.statistics.bias_process import BiasProcess, bias_process, select_by_akaike
from rig.observation.consistency.raw_readings import REST

DISTURBED_SWEEP = "disturbed_sweep"

# At most these checks for one gyroscope, and the check of its worst sweep.
CHECKS = (
    "axis_changed",
    "bias_jumped",
    "cw_against_ccw",
    "loose_mounting",
    "residuals",
    "scale_changed",
    "sweeps_against_rests",
)

MAX_RIPPLE_INFLATION, INFLATION_STEPS = 16.0, 7  # of the variance by a synchronous ripple; factors tried


@dataclass(frozen=True, slots=True)
class ErrorPatterns:
    """The known errors of N segments. A pattern is the change of the readings by one standard deviation of one error.

    - `patterns_rad_s` (P, N, 3): all patterns; `encoders_rad_s` (E, N, 3): only those of encoder errors in arcs.
    - `transfers`: the N segments followed by the transfers, M segments in all; `transfer_patterns_rad_s` (Q, M, 3): the
      patterns of these M segments.
    - `instability_rad_s`: the sensor's bias instability, 0 if unknown.
    """

    patterns_rad_s: Array
    encoders_rad_s: Array
    transfers: Segments
    transfer_patterns_rad_s: Array
    instability_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _TestedSegments:
    """Segments, their mean rates (N, 3) along the sensor's axes, and the whitened model."""

    segments: Segments
    axis_rates: Array
    model: WhitenedSegments

    @property
    def means(self) -> Means:
        """The rates along the sensor's axes in each segment, with the segments' times and sweeps."""
        return Means(self.axis_rates, self.segments.times_s, self.segments.sweep)


def check_gyroscope(
    segments: Segments, matrix: Array, false_alarm_probability: float, allowance: ErrorPatterns
) -> TestResults:
    """Return the tests of a gyroscope's model against each alternative, the outlying sweeps, and the detection limits.

    Lasting changes are tested on the `segments` and the transfers between them, all other faults on the segments alone.
    Each test has the given false-alarm probability. `matrix` (3, 3) is the gyroscope's; `allowance` contains the known
    errors, which no test may take for a fault, and the transfers.
    """
    segments = _steady_rates(segments, matrix)
    allowance = replace(allowance, transfers=_steady_rates(allowance.transfers, matrix))
    axis_rates = segments.rates_rad_s @ matrix.T
    scatter = _build_scatter(segments, allowance.patterns_rad_s, allowance)
    # Otherwise encoder errors beyond the stated ones would be taken for a drift of the bias, and go unnoticed.
    encoders = np.moveaxis(allowance.encoders_rad_s, 0, -1)
    steady_columns = _steady_columns(segments, encoders.reshape(len(encoders), -1))
    bias = _estimate_bias_process(segments, axis_rates, steady_columns, scatter)
    segments_only = _TestedSegments(segments, axis_rates, whiten_segments(segments, scatter, bias))
    with_transfers, axis_changed = _free_disturbed_transfers(
        segments_only, matrix, allowance, bias, false_alarm_probability
    )
    sweeps_alone = repeat_per_axis(segments_only.means.sweeps)
    statistics = test_alternatives(
        with_transfers.model, changes(with_transfers.segments, with_transfers.axis_rates), false_alarm_probability
    )
    statistics |= test_alternatives(
        segments_only.model,
        differences(segments, axis_rates, np.concatenate([sweeps_alone, encoders.swapaxes(0, 1)], axis=2)),
        false_alarm_probability,
    )
    if axis_changed is not None:
        statistics["axis_changed"] = axis_changed
    bias_jump = _test_bias_jump(segments, axis_rates, scatter, false_alarm_probability)
    if bias_jump is not None:
        statistics["bias_jumped"] = bias_jump
    sweeps = distinct(segments.sweep[segments.sweep >= 0]).tolist()
    ranked = find_outliers(
        segments_only.model, sweeps, lambda sweep: sweep_columns(segments, sweep), false_alarm_probability
    )
    disturbed = {sweep: statistic for sweep, statistic in ranked if statistic[0] > statistic[1]}
    return TestResults(
        statistics,
        ranked[0][1],
        disturbed,
        dict(_detection_limits(segments_only, with_transfers, false_alarm_probability)),
    )


def _steady_rates(segments: Segments, matrix: Array) -> Segments:
    """Return the segments with the rate of each replaced by its sweep's mean rate, and with readings to match.

    The tested columns are made from the rates. The rates of single segments contain encoder noise, which is in the
    residuals too, so that the columns would explain this part of the residuals.
    """
    rates = segments.rates_rad_s.copy()
    for sweep in distinct(segments.sweep[segments.sweep > REST]):
        rates[segments.sweep == sweep] = rates[segments.sweep == sweep].mean(axis=0)
    means = segments.means_rad_s - (segments.rates_rad_s - rates) @ matrix.T
    return replace(segments, rates_rad_s=rates, means_rad_s=means)


def predict_detection_limits(
    segments: Segments, matrix: Array, false_alarm_probability: float, allowance: ErrorPatterns
) -> dict[str, float]:
    """Return the minimal detectable size of each fault mode, by its name, in planned segments.

    `matrix` (3, 3) is the gyroscope's; `allowance` contains the known errors and the transfers. The bias drifts only by
    its instability (flicker), because no readings show a random walk or scatter.
    """
    bias = BiasProcess(instability_rad_s=allowance.instability_rad_s)
    scatter = _build_scatter(segments, allowance.patterns_rad_s, allowance)
    segments_only = _TestedSegments(segments, segments.rates_rad_s @ matrix.T, whiten_segments(segments, scatter, bias))
    return dict(
        _detection_limits(segments_only, _whiten_with_transfers(matrix, allowance, bias), false_alarm_probability)
    )


def _free_disturbed_transfers(
    segments_only: _TestedSegments,
    matrix: Array,
    allowance: ErrorPatterns,
    bias: BiasProcess,
    false_alarm_probability: float,
) -> tuple[_TestedSegments, Statistic | None]:
    """Return the segments with transfers, in a model in which outlying transfers have own means, and the axis test.

    The axis test is the statistic of a change of one axis's scale factor, None if the model contains such a change. A
    ripple at the data rate shifts the mean of one transfer, a change of the sensor those of all later transfers. So a
    transfer is an outlier only if its own mean explains clearly more of the residuals than any such change.
    """
    disturbed: list[int] = []
    while True:
        with_transfers = _inflate_transfers(segments_only, matrix, allowance, bias, disturbed)
        segments, model = with_transfers.segments, with_transfers.model
        axis_columns = single_axis_columns(segments, with_transfers.axis_rates)
        axis_changed = model.test_single_columns(axis_columns, false_alarm_probability)
        transfers = [number for number in segments.sweep[segments.sweep < REST].tolist() if number not in disturbed]
        if not transfers or axis_changed is None:
            return with_transfers, axis_changed
        worst, (explained, limit) = find_outliers(
            model, transfers, partial(sweep_columns, segments), false_alarm_probability
        )[0]
        by_change = model.chi_square_of(list(changes(segments, with_transfers.axis_rates).values()), ())
        if explained <= max(limit, max(axis_changed[0], *by_change) + CHI_SQUARE_MARGIN):
            return with_transfers, axis_changed
        disturbed.append(worst)


def _inflate_transfers(
    segments_only: _TestedSegments, matrix: Array, allowance: ErrorPatterns, bias: BiasProcess, disturbed: Sequence[int]
) -> _TestedSegments:
    """Return the segments with transfers, whose unexplained variance is inflated until their χ² is at most its dof.

    The transfers' χ² and dof are those of segments with transfers minus those of segments alone. The factor on the
    variance is at most `MAX_RIPPLE_INFLATION`. Each `disturbed` transfer has a mean of its own.
    """
    transfers, (segments_chi_square, segments_dof) = allowance.transfers, _residual_chi_square(segments_only)
    with_transfers = _whiten_with_transfers(matrix, allowance, bias, disturbed)
    for ratio in np.geomspace(1.0, MAX_RIPPLE_INFLATION, INFLATION_STEPS)[1:]:
        chi_square, dof = _residual_chi_square(with_transfers)
        if chi_square - segments_chi_square <= dof - segments_dof:
            break
        variances = transfers.variances_rad2_s2 + (ratio - 1) * transfers.unexplained_rad2_s2
        with_transfers = _whiten_with_transfers(
            matrix, replace(allowance, transfers=replace(transfers, variances_rad2_s2=variances)), bias, disturbed
        )
    return with_transfers


def _residual_chi_square(tested: _TestedSegments) -> tuple[float, int]:
    """Return the residuals' χ² after a fit of the model and of all tested changes, and its degrees of freedom.

    Changes that differ from the model only by the noise of the rates are not fitted; without transfers there are some.
    """
    changed = [*changes(tested.segments, tested.axis_rates).values(), quarter_columns(tested.means)]
    columns = [apply_whitener(tested.model.whitener, change) for change in changed]
    basis = tested.model.basis
    possible = remaining_directions(basis, np.concatenate(columns, axis=1))
    return chi_square_of(tested.model.readings, np.concatenate([basis, possible], axis=1), None)


def _whiten_with_transfers(
    matrix: Array, allowance: ErrorPatterns, bias: BiasProcess, disturbed: Sequence[int] = ()
) -> _TestedSegments:
    """Return the segments of sweeps and rests and the transfers between them, with their whitened model.

    In this model each `disturbed` transfer has a mean of its own.
    """
    transfers = allowance.transfers
    scatter = _build_scatter(transfers, allowance.transfer_patterns_rad_s, allowance)
    model = whiten_segments(transfers, scatter, bias)
    offsets = [apply_whitener(model.whitener, sweep_columns(transfers, number)) for number in disturbed]
    model = replace(model, model=np.concatenate([model.model, *offsets], axis=1))
    return _TestedSegments(transfers, transfers.rates_rad_s @ matrix.T, model)


def _detection_limits(
    segments_only: _TestedSegments, with_transfers: _TestedSegments, false_alarm_probability: float
) -> Iterator[tuple[str, float]]:
    """Yield the name of every fault mode, with the minimal size that its check detects."""
    segments, chance = segments_only.segments, critical_value(false_alarm_probability)
    steps, sweeps = step_columns(segments), distinct(segments.sweep[segments.sweep >= 0]).tolist()
    of_transfers, of_segments = (
        changes(with_transfers.segments, with_transfers.axis_rates),
        differences(segments, segments_only.axis_rates, None),
    )
    tests: dict[str, tuple[_TestedSegments, list[Alternative]]] = {
        name: (tested, [(columns, chance)])
        for tested, columns_by_name in ((with_transfers, of_transfers), (segments_only, of_segments))
        for name, columns in columns_by_name.items()
        if columns is not None
    }
    tests["axis_changed"] = (
        with_transfers,
        list(
            with_transfers.model.single_column_alternatives(
                single_axis_columns(with_transfers.segments, with_transfers.axis_rates), false_alarm_probability
            )
        ),
    )
    per_sweep = critical_value(false_alarm_probability / len(sweeps))
    tests["disturbed_sweep"] = segments_only, [(sweep_columns(segments, sweep), per_sweep) for sweep in sweeps]
    if len(steps) > 1:
        steady_model = replace(
            segments_only.model,
            model=apply_whitener(segments_only.model.whitener, repeat_per_axis(_steady_columns(segments))),
        )
        limit = _jump_critical_value(len(steps), false_alarm_probability)
        tests["bias_jumped"] = (
            replace(segments_only, model=steady_model),
            [(repeat_per_axis(step), lambda _: limit) for step in steps],
        )
    for fault_mode in FAULT_MODES:
        if fault_mode.check in tests:
            tested, alternatives = tests[fault_mode.check]
            yield fault_mode.what, tested.model.minimal_detectable_size(fault_mode.patterns(tested.means), alternatives)


def _test_bias_jump(
    segments: Segments, axis_rates: Array, scatter: Scatter, false_alarm_probability: float
) -> Statistic | None:
    """Return the χ² of the largest bias jump between two rests, beyond drift, and its critical value.

    A jump is possible at the end of each sweep that lies between two rests. Return None if there are fewer than two.
    Few rests determine the drift poorly, so the critical value is that of an F distribution, whose denominator has one
    degree of freedom for each possible jump. Simulated random walks exceed the critical value about as often as the
    false-alarm probability states.
    """
    steady_columns, steps = _steady_columns(segments), step_columns(segments)
    if len(steps) < 2:
        return None

    def explain_step(step: Array, nuisance: Array) -> float:
        """Return the χ² that a step of the bias explains if the bias process is estimated together with `nuisance`."""
        bias = _estimate_bias_process(segments, axis_rates, nuisance, scatter)
        whitener = build_whitener(segments, scatter, bias)
        readings = apply_whitener(whitener, (segments.means_rad_s - axis_rates).T[:, :, None])[:, 0]
        return chi_square_of(
            readings,
            orthonormal_basis(apply_whitener(whitener, repeat_per_axis(steady_columns))),
            apply_whitener(whitener, repeat_per_axis(step)),
        )[0]

    residuals = segments.means_rad_s - axis_rates
    residuals = residuals - steady_columns @ (steady_columns.T @ residuals)
    step_residuals = [step - steady_columns @ (steady_columns.T @ step) for step in steps]
    best = max(
        range(len(steps)),
        key=lambda k: float(np.sum((step_residuals[k].T @ residuals) ** 2 / np.sum(step_residuals[k] ** 2))),
    )
    # The bias process is estimated with the best jump in the model, because otherwise its drift would contain the jump.
    nuisance = orthonormal_basis(np.column_stack([steady_columns, steps[best]]))
    return explain_step(steps[best], nuisance), _jump_critical_value(len(steps), false_alarm_probability)


def _jump_critical_value(jumps: int, false_alarm_probability: float) -> float:
    """Return the critical value for a bias jump that may occur at any of `jumps` instants."""
    from scipy.special import fdtri

    return 3 * float(fdtri(3, jumps, 1 - false_alarm_probability / jumps))


def _estimate_bias_process(
    segments: Segments, axis_rates: Array, steady_columns: Array, scatter: Scatter
) -> BiasProcess:
    """Return the bias process, estimated from the residuals after a fit of the orthonormal `steady_columns` (N, k)."""
    return bias_process(
        steady_columns,
        segments.means_rad_s - axis_rates,
        scatter.variances_rad2_s2,
        segments.times_s,
        scatter.common_rad2_s2,
        instability_rad_s=scatter.instability_rad_s,
        chosen=select_by_akaike,
    )


def _build_scatter(segments: Segments, patterns_rad_s: Array, allowance: ErrorPatterns) -> Scatter:
    """Return the errors of the segments' means: noise, and the known errors of arm and sensor (`patterns_rad_s`)."""
    return Scatter(segments.variances_rad2_s2, patterns_rad_s, allowance.instability_rad_s)


def _steady_columns(segments: Segments, *more: Array) -> Array:
    """Return an orthonormal basis (N, k) of levels of each sweep and of all rests, gravity, steady drift and `more`."""
    levels = [segments.sweep == sweep for sweep in distinct(segments.sweep)]
    return orthonormal_basis(np.column_stack([*levels, segments.gravity_m_s2, normalise_time(segments), *more]))
