"""Calibration by rotations of known angle from rest to rest.

The rate during a rotation does not matter, so a hand may turn the gyroscope. The integral of the rate
(`rig.estimation.gyroscope.increments`) is compared with the angle:

    Log(exp(n α) R(F, c)ᵀ) = J δθ + e

R is the body's rotation, integrated from the gyroscope's readings m = F ω + c, n the axis in the body's frame, α the
angle, δθ the error of F and c, and J the derivative by these. e contains the end attitude's error about all three axes,
the effect of a tilted axis, and the gyroscope's noise. A whole revolution determines nᵀ F n alone; the mean reading
determines the components across n, if the axis is fixed in the body:

    m̄ = F n α/T + c                                                      across F n

Rests determine c; for sweeps at a constant speed, the mean is used, as in `rig.estimation.gyroscope.vector_model`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.gyroscope.increments import increments
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

MAX_ITERATIONS, CONVERGED_STEP_RATIO = 20, 1e-3  # step relative to the standard uncertainty
MAX_END_ERROR_RAD = 0.02  # of an end attitude: beyond, the stated rotation is wrong
MAX_CONVERGING_RAD = 0.5  # after the first step: beyond, the turns contradict each other, and no solution is near
MAX_CONDITION = 100.0
REMEDY = "Turn about three different axes, either way round, or let it lie still once more"
NOISE, BIAS, ENDS, AXES = "noise", "bias from rest to rest", "ends of the turns", "axes of the turns"


@dataclass(frozen=True, slots=True)
class Turn:
    """A rotation from rest to rest: from `start_s` to `end_s` about the unit `axis` (3,) of the body by `angle_rad`.

    `angle_std_rad` is the standard uncertainty of the end attitude about any axis, `axis_std_rad` that of the `axis`.
    """

    start_s: float
    end_s: float
    axis: Array
    angle_rad: float
    angle_std_rad: float
    axis_std_rad: float


@dataclass(frozen=True, slots=True)
class RateMean:
    """A mean `reading` (3,) with its `variance` (3,) at the constant `rate` (3,), zero at rest."""

    reading: Array
    variance: Array
    rate: Array


@dataclass(frozen=True, slots=True)
class Gyroscope:
    """All readings (n, 3) in rad/s at times (n,), angle random walk, and the std (3,) of the bias about its mean."""

    time_s: Array
    readings: Array
    random_walk_rad_sqrt_s: float
    bias_std_rad_s: Array


@dataclass(frozen=True, slots=True)
class TurnedSolution:
    """A solution with the fields of `vector_model.VectorSolution`; `budget` divides its covariance by cause.

    - `residuals_rad_s` (N, 3): first those of the means, then those of the rotations, expressed as mean rates.
    - `inflation`: the Birge ratio of the rotations, at least 1, with `inflation_dof` degrees of freedom.
    - `estimator`: the name of the method, "increments" or "by_hand".
    """

    scale: Array
    bias_rad_s: Array
    covariance: Array
    matrix: Array
    matrix_covariance: Array
    non_orthogonality_rad: Array
    mounting: Array
    angles_covariance_rad2: Array
    residuals_rad_s: Array
    inflation: float
    inflation_dof: float
    budget: Budget
    observations: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...] = ()
    g_sensitivity: None = None
    g_sensitivity_covariance: None = None
    estimator: str = "increments"


@dataclass(frozen=True, slots=True)
class _ObservationEquations:
    """The equations `observed` (r,) = `design` (r, 12) × step + errors, for a step of matrix F and offset c.

    Each of the `causes` of errors is an array (r, q) of q patterns, each for one standard deviation of an error.
    """

    observed: Array
    design: Array
    causes: dict[str, Array]

    @property
    def covariance(self) -> Array:
        total: Array = np.sum([cause @ cause.T for cause in self.causes.values()], axis=0)
        return total

    def inflate(self, ratio: float) -> "_ObservationEquations":
        """Return the equations with the rotations' errors multiplied by a ratio."""
        return replace(
            self, causes={name: ratio * cause if name in (ENDS, AXES) else cause for name, cause in self.causes.items()}
        )


@dataclass(frozen=True, slots=True)
class _TurnsEstimate:
    """An iterate of the solution: matrix F (3, 3) and offset c (3,) of reading = F × rate + c."""

    matrix: Array
    offset: Array

    def after_step(self, step: Array) -> "_TurnsEstimate":
        return _TurnsEstimate(self.matrix + step[:9].reshape(3, 3), self.offset + step[9:])


def solve_turned(
    gyroscope: Gyroscope, turns: Sequence[Turn], means: Sequence[RateMean], matrix: Array, bias_rad_s: Array
) -> TurnedSolution:
    """Return the gyroscope's calibration from turns and means, by Gauss–Newton steps from `matrix` and `bias_rad_s`.

    Raise Fault `rank_deficient`, `ill_conditioned`, `turn_not_closed`, `wrong_unit`, `mirrored_axis`.
    """
    state = _TurnsEstimate(matrix, -bias_rad_s)
    iterations, settled = 0, False
    while not settled and iterations < MAX_ITERATIONS:
        equations = _equate(gyroscope, turns, means, state)
        if not iterations:
            _conditioning(equations)
        elif (missed_rad := _find_missed_rad(turns, equations[len(means) :])).max() > MAX_CONVERGING_RAD:
            raise _not_closed(turns, missed_rad, float(missed_rad.max()))
        step, covariance = _solve(equations)
        state, iterations = state.after_step(step), iterations + 1
        settled = bool((np.abs(step) < CONVERGED_STEP_RATIO * np.sqrt(np.diag(covariance))).all())
    equations = _equate(gyroscope, turns, means, state)
    ratio, dof = _find_birge_ratio(turns, equations[len(means) :], covariance)  # pyrefly: ignore[unbound-name]  # MAX_ITERATIONS > 0
    _check_closed(turns, equations[len(means) :], ratio)
    equations = [equation.inflate(ratio) for equation in equations]
    step, covariance = _solve(equations)
    state = state.after_step(step)
    refusals.check_unit(scale_of(state.matrix))
    refusals.check_handedness(state.matrix)
    axes = SensorAxes.from_matrix(state.matrix)
    to_parameters = parameter_jacobian(state.matrix, axes.scale)
    conditioning = _conditioning(equations)
    return TurnedSolution(
        scale=axes.scale,
        bias_rad_s=-state.offset,
        covariance=to_parameters @ covariance @ to_parameters.T,
        matrix=state.matrix,
        matrix_covariance=covariance,
        non_orthogonality_rad=axes.non_orthogonality_rad,
        mounting=axes.mounting,
        angles_covariance_rad2=axes.angles_covariance_rad2(covariance[:9, :9]),
        residuals_rad_s=np.array([(equation.observed - equation.design @ step)[:3] for equation in equations]),
        inflation=ratio,
        inflation_dof=dof,
        budget=_budget(equations, to_parameters @ covariance),
        observations=len(equations),
        rank=conditioning.rank,
        condition=conditioning.condition,
        iterations=iterations,
    )


def _equate(
    gyroscope: Gyroscope, turns: Sequence[Turn], means: Sequence[RateMean], state: _TurnsEstimate
) -> list[_ObservationEquations]:
    """Return the equations of the `means`, then those of the `turns`, whose rotations are expressed as mean rates."""
    windows_s = np.array([(turn.start_s, turn.end_s) for turn in turns])
    turned = increments(gyroscope.time_s, gyroscope.readings, state.matrix, state.offset, windows_s)
    return [
        *(_equate_mean(mean, gyroscope, state) for mean in means),
        *(
            _equate_rotation(turn, rotation, jacobian, gyroscope, state)
            for turn, rotation, jacobian in zip(turns, turned.rotations, turned.jacobian, strict=True)
        ),
    ]


def _equate_mean(mean: RateMean, gyroscope: Gyroscope, state: _TurnsEstimate) -> _ObservationEquations:
    causes = {NOISE: np.diag(np.sqrt(mean.variance)), BIAS: np.diag(gyroscope.bias_std_rad_s)}
    return _ObservationEquations(
        mean.reading - state.matrix @ mean.rate - state.offset, _derive(mean.rate, np.eye(3)), causes
    )


def _equate_rotation(
    turn: Turn, rotation: Array, jacobian: Array, gyroscope: Gyroscope, state: _TurnsEstimate
) -> _ObservationEquations:
    """Return a turn's five equations: three for the integrated `rotation`, two for the mean reading across the axis."""
    from scipy.spatial.transform import Rotation

    time_s = gyroscope.time_s
    between = slice(*np.searchsorted(time_s, (turn.start_s, turn.end_s)).tolist())
    reading = np.trapezoid(gyroscope.readings[between], time_s[between], axis=0) / np.ptp(time_s[between])
    lasting_s = turn.end_s - turn.start_s
    stated = np.asarray(Rotation.from_rotvec(turn.axis * turn.angle_rad).as_matrix(), dtype=np.float64)
    missed = Rotation.from_matrix(stated @ rotation.T).as_rotvec()
    turned_rad = turn.axis @ np.linalg.solve(state.matrix, reading - state.offset) * lasting_s
    revolutions = np.rint((turn.angle_rad - turned_rad - turn.axis @ missed) / (2 * np.pi))
    missed = missed + 2 * np.pi * revolutions * turn.axis  # two turns are not one, although they end alike
    rate = turn.axis * turn.angle_rad / lasting_s
    across = _perpendicular_axes(state.matrix @ turn.axis).T  # (2, 3)
    tilt_axes = _perpendicular_axes(turn.axis)  # (3, 2)
    tilted_rate = np.cross(tilt_axes, rate, axis=0)
    random_walk = gyroscope.random_walk_rad_sqrt_s / np.sqrt(lasting_s)
    ends = turn.angle_std_rad / lasting_s * np.eye(3)
    causes = {
        NOISE: random_walk * np.eye(5),
        BIAS: np.vstack([jacobian[:, 9:] / lasting_s, across]) * gyroscope.bias_std_rad_s,
        ENDS: np.vstack([ends, np.zeros((2, 3))]),
        AXES: turn.axis_std_rad
        * np.vstack([(stated - np.eye(3)) @ tilt_axes / lasting_s, across @ state.matrix @ tilted_rate]),
    }
    return _ObservationEquations(
        np.concatenate([missed / lasting_s, across @ (reading - state.matrix @ rate - state.offset)]),
        np.vstack([jacobian / lasting_s, _derive(rate, across)]),
        causes,
    )


def _derive(rate: Array, rows: Array) -> Array:
    """Return the derivative (r, 12) of `rows` (r, 3) · (F `rate` + c) with respect to F, row by row, and c."""
    return np.asarray(np.hstack([np.kron(rows, rate), rows]), dtype=np.float64)


def _perpendicular_axes(axis: Array) -> Array:
    """Return unit vectors (3, 2) at right angles to an axis (3,) and to each other."""
    return np.asarray(np.linalg.svd(axis[None])[2][1:].T, dtype=np.float64)


def _solve(equations: Sequence[_ObservationEquations]) -> tuple[Array, Array]:
    """Return the least-squares step (12,) of the matrix (by rows) and then the offset, and the step's covariance."""
    information, gradient = np.zeros((12, 12)), np.zeros(12)
    for equation in equations:
        weighted = equation.design.T @ np.linalg.inv(equation.covariance)
        information += weighted @ equation.design
        gradient += weighted @ equation.observed
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return covariance @ gradient, covariance


def _conditioning(equations: Sequence[_ObservationEquations]) -> refusals.Conditioning:
    """Return the conditioning of the scaled design. Raise Fault `rank_deficient`, `ill_conditioned`."""
    design = np.vstack([equation.design for equation in equations])
    sizes = [np.linalg.norm(design[:, block]) for block in (slice(0, 9), slice(9, 12))]
    conditioning = refusals.condition_of(design / np.repeat(sizes, [9, 3]), 12)
    refusals.check_conditioning(conditioning, 12, MAX_CONDITION, "axis or bias", REMEDY)
    return conditioning


def _find_birge_ratio(
    turns: Sequence[Turn], equations: Sequence[_ObservationEquations], covariance: Array
) -> tuple[float, float]:
    """Return the rotations' Birge ratio and its degrees of freedom; 1 and infinity if χ² is at most its expectation.

    The angles about the turns' axes alone determine the scale factors. They are also judged alone, because many other
    equations that agree would hide one wrong angle, and the larger of the two ratios is returned.
    """
    every = np.eye(5)
    ratios = [(1.0, np.inf)]
    for rows in ([every] * len(turns), [np.append(turn.axis, [0.0, 0.0])[None] for turn in turns]):
        chi_square, dof = 0.0, 0.0
        for judged, equation in zip(rows, equations, strict=True):
            observed, design = judged @ equation.observed, judged @ equation.design
            weight = np.linalg.inv(judged @ equation.covariance @ judged.T)
            chi_square += float(observed @ weight @ observed)
            dof += len(observed) - float(np.trace(weight @ design @ covariance @ design.T))
        if dof > 1 and chi_square > dof:
            ratios.append((float(np.sqrt(chi_square / dof)), dof))
    return max(ratios)


def _check_closed(turns: Sequence[Turn], equations: Sequence[_ObservationEquations], ratio: float) -> None:
    """Raise Fault `turn_not_closed` if rotations contradict their stated angles by more than `MAX_END_ERROR_RAD`."""
    miss_rad = ratio * float(np.median([turn.angle_std_rad for turn in turns]))
    if miss_rad > MAX_END_ERROR_RAD:
        raise _not_closed(turns, _find_missed_rad(turns, equations), miss_rad)


def _find_missed_rad(turns: Sequence[Turn], equations: Sequence[_ObservationEquations]) -> Array:
    """Return the angles (k,), rad, by which rotations miss the stated ones."""
    lasts_s = np.array([turn.end_s - turn.start_s for turn in turns])
    return np.asarray(np.linalg.norm([equation.observed[:3] for equation in equations], axis=1) * lasts_s)


def _not_closed(turns: Sequence[Turn], missed_rad: Array, typical_rad: float) -> Fault:
    worst = turns[int(np.argmax(missed_rad))]
    return Fault(
        "turn_not_closed",
        f"the turns contradict each other by {1e3 * typical_rad:.0f} mrad, most of all the one from "
        f"{worst.start_s:.1f} to {worst.end_s:.1f} s",
        "Turn against a stop, so that it ends where it began; check that the rows have the real angles and axes",
    )


def _budget(equations: Sequence[_ObservationEquations], gain: Array) -> Budget:
    """Return each cause's contribution; `gain` (6, 12) maps the least squares' gradient to scale and bias."""
    sources = {
        NOISE: "scatter of the readings",
        BIAS: "scatter of the rests",
        ENDS: "angle_std_rad, wider where the turns contradict each other",
        AXES: "axis_std_rad, wider where the turns contradict each other",
    }
    covariances = {name: np.zeros((6, 6)) for name in sources}
    for equation in equations:
        response = gain @ equation.design.T @ np.linalg.inv(equation.covariance)
        for name, patterns in equation.causes.items():
            effect = response @ patterns
            covariances[name] += effect @ effect.T
    kinds: dict[str, Literal["A", "B"]] = {NOISE: "A", BIAS: "A", ENDS: "B", AXES: "B"}
    return Budget(
        tuple(
            Contributor(name, kinds[name], "normal", None, "", source, np.inf, covariances[name])
            for name, source in sources.items()
        )
    )
