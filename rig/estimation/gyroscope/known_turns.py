"""Turns between rests: a gyroscope that was turned by a known angle and lay still before and after.

How fast it was turned on the way does not matter, so a hand may do it. The gyroscope's integral over the way
(`rig.estimation.gyroscope.increments`) is held against the angle:

    Log(exp(n α) R(F, c)ᵀ) = J δθ + e

R is how the body turned by its gyroscope (m = F ω + c), n the axis in the body's frame, α the angle. e is by how far
the body did not come to where it was said to, about all three axes, what a leaning axis does to that, and the
gyroscope's noise. A whole turn tells nᵀ F n and nothing of what is across: that the mean reading says, as far as the
axis did not lean in the body,

    m̄ = F n α/T + c                                                      across F n

Rests tell c; sweeps at a constant speed are read by their mean, as in `rig.estimation.gyroscope.vector_model`.
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

PASSES, SETTLED = 20, 1e-3  # of the standard uncertainty
FARTHEST_RAD = 0.02  # that a turn may end off what was said of it: beyond, it was another turn
MAX_CONDITION = 100.0
REMEDY = "Turn about three different axes, either way round, or let it lie still once more"
NOISE, BIAS, ENDS, AXES = "noise", "bias from rest to rest", "ends of the turns", "axes of the turns"


@dataclass(frozen=True, slots=True)
class Turn:
    """A turn from rest to rest: from `start_s` to `end_s` about the unit `axis` (3,) of the body by `angle_rad`.

    `angle_std_rad`: how well the body came to where it was said to, about any axis; `axis_std_rad`: how far its axis
    may have leaned in the body.
    """

    start_s: float
    end_s: float
    axis: Array
    angle_rad: float
    angle_std_rad: float
    axis_std_rad: float


@dataclass(frozen=True, slots=True)
class Mean:
    """A `reading` (3,) with its `variance` (3,) at the constant `rate` (3,), of known direction, or at rest."""

    reading: Array
    variance: Array
    rate: Array


@dataclass(frozen=True, slots=True)
class Gyroscope:
    """All readings (n, 3) in rad/s at times (n,), its angle random walk, and how its bias differs from rest to rest."""

    time_s: Array
    readings: Array
    random_walk_rad_sqrt_s: float
    bias_std_rad_s: Array


@dataclass(frozen=True, slots=True)
class TurnedSolution:
    """A solution as `vector_model.VectorSolution` has it; `budget` is what the covariance is made of.

    `residuals_rad_s` (N, 3) are those of the means, then of the turns as mean rates; `widened` says how much more the
    turns contradict each other than was said of them, 1 at least, and is known with `widened_freedom`. `estimator` is
    another's name where readings in attitudes are told as turns are.
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
    widened: float
    widened_freedom: float
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
class _Equations:
    """`observed` (r,) = `design` (r, 12) δθ + errors: of each cause the patterns (r, q) of one standard uncertainty."""

    observed: Array
    design: Array
    causes: dict[str, Array]

    @property
    def covariance(self) -> Array:
        total: Array = np.sum([cause @ cause.T for cause in self.causes.values()], axis=0)
        return total

    def widened(self, by: float) -> "_Equations":
        """The equations with the errors of a turn so much larger."""
        return replace(
            self, causes={name: by * cause if name in (ENDS, AXES) else cause for name, cause in self.causes.items()}
        )


@dataclass(frozen=True, slots=True)
class _State:
    """A state of the solution, m = F ω + c."""

    matrix: Array
    offset: Array

    def moved(self, step: Array) -> "_State":
        return _State(self.matrix + step[:9].reshape(3, 3), self.offset + step[9:])


def solve_turned(
    gyroscope: Gyroscope, turns: Sequence[Turn], means: Sequence[Mean], matrix: Array, bias_rad_s: Array
) -> TurnedSolution:
    """F and b, of g = K (m + b), from about where they are: `matrix` (3, 3) and `bias_rad_s` (3,).

    Raises Fault `rank_deficient`, `ill_conditioned`, `turn_not_closed`, `wrong_unit`, `mirrored_axis`.
    """
    state = _State(matrix, -bias_rad_s)
    iterations, settled = 0, False
    while not settled and iterations < PASSES:
        equations = _equations(gyroscope, turns, means, state)
        if not iterations:
            _conditioning(equations)
        step, covariance = _solve(equations)
        state, iterations = state.moved(step), iterations + 1
        settled = bool((np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))).all())
    equations = _equations(gyroscope, turns, means, state)
    widened, freedom = _widened(equations[len(means) :], covariance)
    _check_closed(turns, equations[len(means) :], widened)
    equations = [equation.widened(widened) for equation in equations]
    step, covariance = _solve(equations)
    state = state.moved(step)
    refusals.check_unit(scale_of(state.matrix))
    refusals.check_handedness(state.matrix)
    axes = SensorAxes.of(state.matrix)
    to_parameters = parameter_jacobian(state.matrix, axes.scale)
    told = _conditioning(equations)
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
        widened=widened,
        widened_freedom=freedom,
        budget=_budget(equations, to_parameters @ covariance),
        observations=len(equations),
        rank=told.rank,
        condition=told.condition,
        iterations=iterations,
    )


def _equations(gyroscope: Gyroscope, turns: Sequence[Turn], means: Sequence[Mean], state: _State) -> list[_Equations]:
    """The equations of the means, then of the turns, these as mean rates."""
    windows_s = np.array([(turn.start_s, turn.end_s) for turn in turns])
    turned = increments(gyroscope.time_s, gyroscope.readings, state.matrix, state.offset, windows_s)
    return [
        *(_of_mean(mean, gyroscope, state) for mean in means),
        *(
            _of_turn(turn, rotation, jacobian, gyroscope, state)
            for turn, rotation, jacobian in zip(turns, turned.rotations, turned.jacobian, strict=True)
        ),
    ]


def _of_mean(mean: Mean, gyroscope: Gyroscope, state: _State) -> _Equations:
    causes = {NOISE: np.diag(np.sqrt(mean.variance)), BIAS: np.diag(gyroscope.bias_std_rad_s)}
    return _Equations(mean.reading - state.matrix @ mean.rate - state.offset, _linear(mean.rate, np.eye(3)), causes)


def _of_turn(turn: Turn, rotation: Array, jacobian: Array, gyroscope: Gyroscope, state: _State) -> _Equations:
    """Three of where the body came to, two of the mean reading across the axis."""
    from scipy.spatial.transform import Rotation

    time_s = gyroscope.time_s
    between = slice(*np.searchsorted(time_s, (turn.start_s, turn.end_s)).tolist())
    reading = np.trapezoid(gyroscope.readings[between], time_s[between], axis=0) / np.ptp(time_s[between])
    lasting_s = turn.end_s - turn.start_s
    said = np.asarray(Rotation.from_rotvec(turn.axis * turn.angle_rad).as_matrix(), dtype=np.float64)
    missed = Rotation.from_matrix(said @ rotation.T).as_rotvec()
    rate = turn.axis * turn.angle_rad / lasting_s
    across = _across(state.matrix @ turn.axis).T  # (2, 3)
    leaning = _across(turn.axis)  # (3, 2) about which the axis leans
    leant = np.cross(leaning, rate, axis=0)
    random_walk = gyroscope.random_walk_rad_sqrt_s / np.sqrt(lasting_s)
    ends = turn.angle_std_rad / lasting_s * np.eye(3)
    causes = {
        NOISE: random_walk * np.eye(5),
        BIAS: np.vstack([jacobian[:, 9:] / lasting_s, across]) * gyroscope.bias_std_rad_s,
        ENDS: np.vstack([ends, np.zeros((2, 3))]),
        AXES: turn.axis_std_rad * np.vstack([(said - np.eye(3)) @ leaning / lasting_s, across @ state.matrix @ leant]),
    }
    return _Equations(
        np.concatenate([missed / lasting_s, across @ (reading - state.matrix @ rate - state.offset)]),
        np.vstack([jacobian / lasting_s, _linear(rate, across)]),
        causes,
    )


def _linear(rate: Array, rows: Array) -> Array:
    """(r, 12) derivative of `rows` (r, 3) of F ω + c."""
    return np.hstack([np.kron(rows, rate), rows])


def _across(axis: Array) -> Array:
    """(3, 2) unit vectors at right angles to an axis (3,) and to each other."""
    return np.asarray(np.linalg.svd(axis[None])[2][1:].T, dtype=np.float64)


def _solve(equations: Sequence[_Equations]) -> tuple[Array, Array]:
    """δθ (12,) and its covariance."""
    information, told = np.zeros((12, 12)), np.zeros(12)
    for equation in equations:
        weighted = equation.design.T @ np.linalg.inv(equation.covariance)
        information += weighted @ equation.design
        told += weighted @ equation.observed
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return covariance @ told, covariance


def _conditioning(equations: Sequence[_Equations]) -> refusals.Conditioning:
    """Conditioning of the design, rates and offsets of one size. Raises Fault `rank_deficient`, `ill_conditioned`."""
    design = np.vstack([equation.design for equation in equations])
    sizes = [np.linalg.norm(design[:, each]) for each in (slice(0, 9), slice(9, 12))]
    told = refusals.condition_of(design / np.repeat(sizes, [9, 3]), 12)
    refusals.check_conditioning(told, 12, MAX_CONDITION, "axis or bias", REMEDY)
    return told


def _widened(turns: Sequence[_Equations], covariance: Array) -> tuple[float, float]:
    """How much more the turns miss than was said of them, as far as there are more of them than parameters.

    And with how many degrees of freedom that is known: no end of them where what was said holds.
    """
    chi_square, freedom = 0.0, 0.0
    for turn in turns:
        weight = np.linalg.inv(turn.covariance)
        chi_square += float(turn.observed @ weight @ turn.observed)
        freedom += len(turn.observed) - float(np.trace(weight @ turn.design @ covariance @ turn.design.T))
    if freedom <= 1 or chi_square <= freedom:
        return 1.0, np.inf
    return float(np.sqrt(chi_square / freedom)), freedom


def _check_closed(turns: Sequence[Turn], equations: Sequence[_Equations], widened: float) -> None:
    """Raises Fault `turn_not_closed`."""
    off = widened * float(np.median([turn.angle_std_rad for turn in turns]))
    if off <= FARTHEST_RAD:
        return
    missed = [
        float(np.linalg.norm(equation.observed[:3])) * (turn.end_s - turn.start_s)
        for turn, equation in zip(turns, equations, strict=True)
    ]
    worst = int(np.argmax(missed))
    raise Fault(
        "turn_not_closed",
        f"the turns contradict each other by {1e3 * off:.0f} mrad, most of all the one from {turns[worst].start_s:.1f} "
        f"to {turns[worst].end_s:.1f} s",
        "Turn against a stop, so that it ends where it began; check that the rows have the real angles and axes",
    )


def _budget(equations: Sequence[_Equations], gain: Array) -> Budget:
    """What each cause does to scale and bias; `gain` (6, 12) takes what is told to these."""
    sources = {
        NOISE: "scatter of the readings",
        BIAS: "scatter of the rests",
        ENDS: "angle_std_rad, wider where the turns contradict each other",
        AXES: "axis_std_rad, wider where the turns contradict each other",
    }
    spread = {name: np.zeros((6, 6)) for name in sources}
    for equation in equations:
        told = gain @ equation.design.T @ np.linalg.inv(equation.covariance)
        for name, patterns in equation.causes.items():
            effect = told @ patterns
            spread[name] += effect @ effect.T
    kinds: dict[str, Literal["A", "B"]] = {NOISE: "A", BIAS: "A", ENDS: "B", AXES: "B"}
    return Budget(
        tuple(
            Contributor(name, kinds[name], "normal", None, "", source, np.inf, spread[name])
            for name, source in sources.items()
        )
    )
