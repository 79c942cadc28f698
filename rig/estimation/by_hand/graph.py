"""The factor graph of a session by hand: its unknowns, and the equations of every rest and move.

The unknowns are the gyroscope's matrix F, g-sensitivity G and nonlinearity, the accelerometer's matrix F_a and offset
b_a, the table's tilt, the faces' normals, and for each rest the attitude Q (body to table) and the gyroscope's bias b.
A factor has rows of equations, with the standard deviation of each cause of their errors (Dellaert and Kaess, Factor
Graphs for Robot Perception, 2017).

R is the body's rotation from rest i to rest j, computed from the gyroscope's readings; m̄ and ā are the mean readings
of gyroscope and accelerometer in a rest, and f is the upward vertical in the body. The factors have these residuals:

- move: Log(R (Qᵢᵀ Qⱼ)ᵀ), with the gyroscope's noise and an error in proportion to the angle
- rest: m̄ − b − G f; walk: the change of the bias from rest to rest, minus the change of a parabolic drift
- flat: the table's normal in the body minus the face's normal; box: the face's normal minus the nominal one
- closure: the change of the heading in a whole turn; lean: the mean axis of a turn minus the face's normal
- acceleration: ā − F_a Qᵀ g − b_a. The accelerometer serves as a level, so the vertical component has little weight
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.estimation.arrays import Array, axis_of, rotation_vectors
from rig.estimation.by_hand.move_rotations import GyroscopeModel, MoveIntegrals
from rig.estimation.by_hand.session_parts import FACES, HandRecording, HandStds, RestFaces, SessionConditions

MATRIX, GRAVITY, LEVEL, OFFSET, TABLE, BOX, NONLINEARITIES, DRIFT = (
    slice(0, 9), slice(9, 18), slice(18, 27), slice(27, 30), slice(30, 32), slice(32, 44), slice(44, 50), slice(50, 56),
)  # fmt: skip
RESTS = 56  # index of the first rest's parameters; each rest has six: attitude, bias

MATRIX_STD = 0.2  # prior of an element of F
SENSITIVITY_STD = float(np.radians(0.1))  # prior of an element of G, rad/s per g
LEVEL_STD, OFFSET_STD_M_S2 = 0.05, 1.0
TABLE_STD_RAD = 0.02
BIAS_STD_RAD_S = 1.0
# Prior of the bias' drift from the first rest to the last, and of its middle from the line between these: a part
# that warms up.
DRIFT_STD_RAD_S, CURVE_STD_RAD_S = 1e-3, 3e-4
EARTH_STD_RAD_S = 5e-5  # prior of each axis: on the same face the Earth's rate is sensed alike
AXIS_TILT_STD_RAD = 0.02
HAND_RATE_RAD_S = float(np.radians(150))  # usual rate of a hand during half of a move
NONLINEARITY = 7e-5  # relative error of a move's angle at that rate, even and odd, for each axis: as in data sheets
GAPLESS_FRACTION = 0.95
# The angle to which `HandStds.of_angle` refers; the error of many pushes grows with the root of the angle.
QUARTER_RAD = np.pi / 2
VERTICAL_ERROR_STD_M_S2 = 0.1  # of an accelerometer's own errors
HEADING_STD_RAD = 1.0
# Bandwidth of a hand that holds the body; ratio to the scatter of quiet rests up to which no hand holds it.
TREMOR_BANDWIDTH_HZ, QUIET_SCATTER_RATIO = 4.0, 1.5

MOVE, REST, WALK, FLAT, CLOSURE, TILT, ACCELERATION, PRIOR = (
    "move", "rest", "walk", "flat", "closure", "lean", "acceleration", "prior",
)  # fmt: skip
ROUNDING = "rounding"  # a cause of errors


@dataclass(frozen=True, slots=True)
class GraphState:
    """The current values of all unknowns.

    - matrix (3, 3): F, the scale factors and axes.
    - sensitivity (3, 3): G, the g-sensitivity in rad/s per g.
    - nonlinearities: the even and the odd nonlinearity (6,), s/rad.
    - drift_rad_s (2, 3): row 0 is the bias' steady drift from the first rest to the last, row 1 the deviation from it
      at half time.
    - level: the accelerometer's matrix F_a (3, 3).
    - offset: the accelerometer's offset b_a (3,), m/s².
    - table: the table's tilt (2,), rad.
    - normals: the tilt of each face relative to its nominal normal (6, 2), rad.
    - attitudes: the attitudes (N, 3, 3) at the rests, body to table.
    - biases: the biases (N, 3) at the rests, rad/s.
    """

    matrix: Array
    sensitivity: Array
    nonlinearities: Array
    drift_rad_s: Array
    level: Array
    offset: Array
    table: Array
    normals: Array
    attitudes: Array
    biases: Array

    @property
    def gyroscope(self) -> GyroscopeModel:
        """The gyroscope's model at the current values."""
        return GyroscopeModel(self.matrix, self.biases, self.sensitivity, self.nonlinearities)

    def after_step(self, step: Array) -> "GraphState":
        """Return the values after a step (p,) in the order of the design's columns."""
        from scipy.spatial.transform import Rotation

        of_rests = step[RESTS:].reshape(-1, 6)
        turned = np.asarray(Rotation.from_rotvec(of_rests[:, :3]).as_matrix(), dtype=np.float64)
        return replace(
            self,
            matrix=self.matrix + step[MATRIX].reshape(3, 3),
            sensitivity=self.sensitivity + step[GRAVITY].reshape(3, 3),
            nonlinearities=self.nonlinearities + step[NONLINEARITIES],
            drift_rad_s=self.drift_rad_s + step[DRIFT].reshape(2, 3),
            level=self.level + step[LEVEL].reshape(3, 3),
            offset=self.offset + step[OFFSET],
            table=self.table + step[TABLE],
            normals=self.normals + step[BOX].reshape(6, 2),
            attitudes=self.attitudes @ turned,
            biases=self.biases + of_rests[:, 3:],
        )


@dataclass(frozen=True)
class Factor:
    """Rows (r,) of equations: after a step δ their residual is `residual` + `design` δ, with `design` (r, p).

    `causes` are the standard deviations (r,) of independent errors of the rows, by name; `index` is the rest or move.
    """

    kind: str
    index: int
    residual: Array
    design: Array
    causes: dict[str, Array]

    @cached_property
    def std(self) -> Array:
        """The standard deviation (r,) of each row, of all causes together."""
        return np.asarray(np.sqrt(sum(np.square(std) for std in self.causes.values())), dtype=np.float64)


@dataclass(frozen=True)
class Graph:
    """A session with its faces and conditions, current values of the unknowns, and the moves integrated with these."""

    session: HandRecording
    faces: RestFaces
    conditions: SessionConditions
    state: GraphState
    integrals: MoveIntegrals
    stds: HandStds

    @property
    def width(self) -> int:
        """The number of unknowns."""
        return RESTS + 6 * len(self.session.rests)

    @cached_property
    def between(self) -> Array:
        """The attitude (N − 1, 3, 3) at the end of each move, in coordinates of its start."""
        return np.asarray(np.swapaxes(self.state.attitudes[:-1], -1, -2) @ self.state.attitudes[1:], dtype=np.float64)

    @cached_property
    def bias_changes_rad_s(self) -> Array:
        """The change (N − 1, 3) of the gyroscope's bias in each move."""
        return np.asarray(np.diff(self.state.biases, axis=0), dtype=np.float64)

    @cached_property
    def rotations_rad(self) -> Array:
        """The rotation vectors (N − 1, 3) of the rotations `between`."""
        return rotation_vectors(self.between)

    @cached_property
    def residuals_rad(self) -> Array:
        """The rotation vectors (N − 1, 3) by which the gyroscope's rotation in each move exceeds that in `between`."""
        return rotation_vectors(self.integrals.rotations @ np.swapaxes(self.between, -1, -2))

    @cached_property
    def noise_rad_s(self) -> float:
        """The standard deviation of a reading at rest, rad/s."""
        return reading_noise(self.session)

    @cached_property
    def walk_rad_sqrt_s(self) -> float:
        """The angle random walk, rad/√s, if the scatter at rest is white noise."""
        return self.noise_rad_s * float(np.sqrt(np.median(np.diff(self.session.time_s))))

    @cached_property
    def stamp_std_s(self) -> float:
        """The standard deviation of time stamps, from their second differences.

        The largest differences, due to gaps, are omitted. Irregular sampling looks like wrong stamps and is included.
        """
        differences = np.sort(np.abs(np.diff(self.session.time_s, 2)))
        return float(np.sqrt(np.mean(np.square(differences[: round(GAPLESS_FRACTION * len(differences))])) / 6))

    @cached_property
    def quiet_m_s2(self) -> float:
        """The standard deviation of an accelerometer's reading in the quietest rest, m/s²."""
        stds = [rest.acceleration_noise_m_s2 for rest in self.session.rests]
        return float(np.sqrt(np.min([np.mean(std**2) for std in stds if std is not None])))


def linearise(graph: Graph) -> Iterator[Factor]:
    """Yield every factor, linearised at the graph's current values."""
    session, faces = graph.session, graph.faces
    yield from _priors(graph)
    for row, move in enumerate(session.moves):
        if move.is_usable:
            yield _move(graph, row)
        if faces.turns[row]:
            yield _tilt_factor(graph, row)
            if graph.conditions.closure:
                yield _closure(graph, row)
        yield _bias_walk(graph, row)
    for row, rest in enumerate(session.rests):
        yield _rest(graph, row)
        if (face := faces.faces[row]) is not None:
            yield _flat(graph, row, FACES.index(face))
        if rest.acceleration_m_s2 is not None:
            yield _acceleration(graph, row)


def perpendicular_axes(axis: Array) -> Array:
    """Return two unit vectors (2, 3) at right angles to an axis (3,) and to each other."""
    turning = _skew(axis)
    first = turning[:, np.argmin(np.abs(axis))]
    first = first / np.linalg.norm(first)
    return np.array([first, turning @ first])


def reading_noise(session: HandRecording) -> float:
    """Return the standard deviation of a reading at rest, rad/s, over all axes and the quieter half of the rests."""
    scatter = sorted(float(np.mean(rest.noise_rad_s**2)) for rest in session.rests)
    return float(np.sqrt(np.mean(scatter[: (len(scatter) + 1) // 2])))


def _hand_held_std(scatter: Array, quiet: float, lasting_s: float) -> float:
    """Return the std, due to a hand's tremor, of the mean reading of a rest of `lasting_s`.

    The tremor is the part of the readings' std `scatter` (3,) that exceeds the std `quiet` of a body at rest.
    """
    beyond = float(np.mean(scatter**2)) - (QUIET_SCATTER_RATIO * quiet) ** 2
    return float(np.sqrt(max(beyond, 0.0) / max(TREMOR_BANDWIDTH_HZ * lasting_s, 1.0)))


def _rest_columns(row: int) -> tuple[slice, slice]:
    """Return the columns of a rest's attitude and of its bias."""
    return slice(RESTS + 6 * row, RESTS + 6 * row + 3), slice(RESTS + 6 * row + 3, RESTS + 6 * row + 6)


def _move(graph: Graph, row: int) -> Factor:
    """Return the factor of a move, whose integrated rates must rotate the attitude at its start to that at its end."""
    session, integrals, stds = graph.session, graph.integrals, graph.stds
    design = np.zeros((3, graph.width))
    (first, first_bias), (second, second_bias) = _rest_columns(row), _rest_columns(row + 1)
    design[:, MATRIX], design[:, GRAVITY] = integrals.by_matrix[row], integrals.by_gravity[row]
    design[:, NONLINEARITIES] = integrals.by_nonlinearity[row]
    design[:, first_bias] = design[:, second_bias] = integrals.by_bias[row] / 2
    design[:, first], design[:, second] = np.eye(3), -graph.between[row]
    causes = {
        "noise": np.full(3, graph.walk_rad_sqrt_s * np.sqrt(integrals.durations_s[row])),
        "stamps": np.full(3, graph.stamp_std_s * integrals.changes_rad_s[row]),
        "of_angle": np.full(3, stds.of_angle * np.sqrt(QUARTER_RAD * integrals.paths_rad[row])),
        # A bias that jumps does so at any time of the move.
        "jump": np.full(3, np.linalg.norm(graph.bias_changes_rad_s[row]) * integrals.durations_s[row] / np.sqrt(12)),
        # A program that cuts digits makes all rates smaller by half a step. This error is common to all moves, of
        # which a third turn about each axis; the factors count as independent.
        ROUNDING: np.broadcast_to(session.coarse_rad_s, 3)
        * (integrals.durations_s[row] * np.sqrt(len(session.moves) / 3 / 12)),
    }
    return Factor(MOVE, row, graph.residuals_rad[row], design, causes)


def _tilt_factor(graph: Graph, row: int) -> Factor:
    """Return the factor of a turn by an angle α about a face's normal n.

    Its two rows are the components perpendicular to F n of the equation ∫(reading − b) dt / α = F n, with the
    gyroscope's matrix F and bias b.
    """
    normal, matrix = graph.faces.up[row], graph.state.matrix
    integral_rad, duration_s = graph.integrals.swept_rad[row], graph.integrals.durations_s[row]
    angle_rad = float(normal @ integral_rad)
    perpendicular = perpendicular_axes(matrix @ normal / np.linalg.norm(matrix @ normal))
    design = np.zeros((2, graph.width))
    design[:, MATRIX] = -np.kron(perpendicular, normal)
    (_, bias_before), (_, bias_after) = _rest_columns(row), _rest_columns(row + 1)
    design[:, bias_before] = design[:, bias_after] = -perpendicular * duration_s / angle_rad / 2  # b is their mean
    noise = graph.walk_rad_sqrt_s * np.sqrt(duration_s) / abs(angle_rad)
    causes = {"lean": np.full(2, AXIS_TILT_STD_RAD), "noise": np.full(2, noise)}
    return Factor(TILT, row, perpendicular @ (integral_rad / angle_rad - matrix @ normal), design, causes)


def _closure(graph: Graph, row: int) -> Factor:
    """Return the factor of a whole turn, after which the body has the same heading about the vertical again."""
    up = graph.faces.up[row]
    design = np.zeros((1, graph.width))
    design[0, _rest_columns(row)[0]], design[0, _rest_columns(row + 1)[0]] = -up, up @ graph.between[row]
    causes = {"closure": np.array([graph.stds.closure_rad])}
    return Factor(CLOSURE, row, np.array([up @ graph.rotations_rad[row]]), design, causes)


def _bias_walk(graph: Graph, row: int) -> Factor:
    session, state, stds = graph.session, graph.state, graph.stds
    first, second = session.rests[row], session.rests[row + 1]
    apart_s = second.middle_s - first.middle_s
    begin_s, end_s = session.rests[0].middle_s, session.rests[-1].middle_s
    before, after = (np.array([first.middle_s, second.middle_s]) - begin_s) / (end_s - begin_s)
    drifted = np.array([after - before, 4 * after * (1 - after) - 4 * before * (1 - before)])
    design = np.zeros((3, graph.width))
    design[:, DRIFT] = -np.kron(drifted, np.eye(3))
    design[:, _rest_columns(row)[1]], design[:, _rest_columns(row + 1)[1]] = -np.eye(3), np.eye(3)
    causes = {"walk": np.full(3, stds.walk_rad_s_sqrt_s * np.sqrt(apart_s))}
    return Factor(WALK, row, graph.bias_changes_rad_s[row] - drifted @ state.drift_rad_s, design, causes)


def _rest(graph: Graph, row: int) -> Factor:
    """Return the factor of a rest, in which a gyroscope reads its bias plus its g-sensitivity times the vertical."""
    session, state = graph.session, graph.state
    rest, up = session.rests[row], state.attitudes[row][2]
    design = np.zeros((3, graph.width))
    design[:, _rest_columns(row)[1]], design[:, GRAVITY] = -np.eye(3), -np.kron(np.eye(3), up)
    causes = {
        "noise": np.full(3, graph.walk_rad_sqrt_s / np.sqrt(max(rest.end_s - rest.start_s, 1e-3))),
        "earth": np.full(3, EARTH_STD_RAD_S),
        "held": np.full(3, _hand_held_std(rest.noise_rad_s, graph.noise_rad_s, rest.end_s - rest.start_s)),
        # One error common to all rests; the factors count as independent.
        ROUNDING: np.broadcast_to(rest.rounding_rad_s, 3) * np.sqrt(len(session.rests)),
    }
    return Factor(REST, row, rest.mean_rad_s - state.biases[row] - state.sensitivity @ up, design, causes)


def _flat(graph: Graph, row: int, face: int) -> Factor:
    """Return the factor of a rest on a face, in which the vertical in the body is the normal of that face."""
    state = graph.state
    axis, up = axis_of(FACES[face]), state.attitudes[row][2]
    perpendicular = perpendicular_axes(axis)
    design = np.zeros((2, graph.width))
    design[:, _rest_columns(row)[0]] = perpendicular @ _skew(up)
    design[:, BOX.start + 2 * face : BOX.start + 2 * face + 2] = -np.eye(2)
    causes = {"repeat": np.full(2, graph.stds.repeat_rad)}
    return Factor(FLAT, row, perpendicular @ up - state.normals[face], design, causes)


def _acceleration(graph: Graph, row: int) -> Factor:
    """Return the factor of the mean acceleration in rest `row`: two components across the vertical, one along it."""
    session, state, conditions = graph.session, graph.state, graph.conditions
    rest = session.rests[row]
    assert rest.acceleration_m_s2 is not None and rest.acceleration_noise_m_s2 is not None
    up = conditions.gravity_m_s2 * np.array([*state.table, 1.0])
    force = state.attitudes[row].T @ up
    design = np.zeros((3, graph.width))
    design[:, LEVEL], design[:, OFFSET] = -np.kron(np.eye(3), force), -np.eye(3)
    design[:, _rest_columns(row)[0]] = -state.level @ _skew(force)
    design[:, TABLE] = -conditions.gravity_m_s2 * state.level @ state.attitudes[row].T[:, :2]
    direction = force / np.linalg.norm(force)
    axes = np.vstack([perpendicular_axes(direction), direction])
    residual = axes @ (rest.acceleration_m_s2 - state.level @ force - state.offset)
    scatter = float(np.sqrt(np.mean(rest.acceleration_noise_m_s2**2) / max(rest.samples, 1)))
    causes = {
        "acceleration": np.full(3, graph.stds.acceleration_m_s2),
        "acceleration noise": np.full(3, scatter),
        "held": np.full(3, _hand_held_std(rest.acceleration_noise_m_s2, graph.quiet_m_s2, rest.end_s - rest.start_s)),
        "along": np.array([0.0, 0.0, VERTICAL_ERROR_STD_M_S2]),
    }
    return Factor(ACCELERATION, row, residual, axes @ design, causes)


def _priors(graph: Graph) -> Iterator[Factor]:
    """Yield a prior for each block of parameters, for the first bias, and for each heading that no move determines."""
    state, conditions, width = graph.state, graph.conditions, graph.width

    def prior(name: str, columns: slice, residual: Array, std: Array | float) -> Factor:
        return Factor(PRIOR, 0, residual, np.eye(width)[columns], {name: np.full(len(residual), std)})

    yield prior("matrix", MATRIX, (state.matrix - np.eye(3)).ravel(), MATRIX_STD)
    yield prior("g-sensitivity", GRAVITY, state.sensitivity.ravel(), SENSITIVITY_STD)
    yield prior("nonlinearity", NONLINEARITIES, state.nonlinearities, NONLINEARITY / HAND_RATE_RAD_S)
    yield prior("drift", DRIFT, state.drift_rad_s.ravel(), np.repeat([DRIFT_STD_RAD_S, CURVE_STD_RAD_S], 3))
    yield prior("level", LEVEL, (state.level - np.eye(3)).ravel(), LEVEL_STD)
    yield prior("level", OFFSET, state.offset, OFFSET_STD_M_S2)
    yield prior("table", TABLE, state.table, TABLE_STD_RAD)
    yield prior("box", BOX, state.normals.ravel(), conditions.box_rad)
    for row in (0, *(row + 1 for row, move in enumerate(graph.session.moves) if not move.is_usable)):
        design, index = np.zeros((1, width)), RESTS + 6 * row
        design[0, index : index + 3] = state.attitudes[row][2]
        yield Factor(PRIOR, row, np.zeros(1), design, {"heading": np.array([HEADING_STD_RAD])})
    yield prior("bias", slice(RESTS + 3, RESTS + 6), state.biases[0], BIAS_STD_RAD_S)


def _skew(vector: Array) -> Array:
    """Return the matrix (3, 3) whose product with any vector is the cross product of `vector` with it."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
