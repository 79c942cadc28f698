"""The graph of a session: what is sought, and what each rest and each move says of it.

Sought are F, G, how the gyroscope bends, the accelerometer's F_a and b_a, how the table leans, the faces' normals, and
of each rest the attitude Q (body to table) and the gyroscope's bias. A factor is a row of the equations, divided by its
standard deviation; whose that is stands beside it.

- move: Log(R (Qᵢᵀ Qⱼ)ᵀ), as uncertain as the gyroscope's noise and a part of the angle
- rest: m̄ − b − G f; walk: how the bias went from rest to rest
- flat: the table's normal in the body is that of the face on which it lies; box: that face's, against the nominal one
- closure: the heading after a whole turn; lean: the mean axis of a turn is the face's normal
- acceleration: ā − F_a Qᵀ g − b_a, as a level alone: what is along the vertical hardly counts
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.by_hand.moves import Moved, Taken
from rig.estimation.by_hand.session import FACES, Faced, Handled, Sizes, Told, axis_of

MATRIX, GRAVITY, LEVEL, OFFSET, TABLE, BOX, BENDS = (
    slice(0, 9), slice(9, 18), slice(18, 27), slice(27, 30), slice(30, 32), slice(32, 44), slice(44, 50),
)  # fmt: skip
RESTS = 50  # six of each rest from here on: attitude, bias

MATRIX_STD = 0.2  # of an element of F
SENSITIVITY_STD = float(np.radians(0.1))  # rad/s per g, of an element of G
LEVEL_STD, OFFSET_STD_M_S2 = 0.05, 1.0
TABLE_STD_RAD = 0.02
BIAS_STD_RAD_S = 1.0
EARTH_STD_RAD_S = 5e-5  # of each axis: a face that is come back to reads the same of it
LEAN_RAD = 0.02
HAND_RAD_S = float(np.radians(150))  # as fast as a hand turns, half of the way
NONLINEARITY = 7e-5  # of the angle of a move at that speed, even and odd, of each axis: what is known of parts
BUT_GAPS = 0.95
QUARTER_RAD = np.pi / 2  # of which `Sizes.of_angle` is said; it grows with the root, as errors of many pushes do
ALONG_M_S2 = 0.1  # what an accelerometer's own errors may be along the vertical
HEADING_STD_RAD = 1.0
HELD_HZ, AS_QUIET = 4.0, 1.5  # of a hand that holds it; so much more than the quiet rests scatters a rest as well

MOVE, REST, WALK, FLAT, CLOSURE, LEANING, ACCELERATION, PRIOR = (
    "move", "rest", "walk", "flat", "closure", "lean", "acceleration", "prior",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class State:
    """Where the solution is.

    `bends` (6,) of the three axes, even ones and odd ones, in s/rad; `normals` (6, 2) are the faces' own, across the
    nominal ones.
    """

    matrix: Array
    sensitivity: Array
    bends: Array
    level: Array
    offset: Array
    table: Array
    normals: Array
    attitudes: Array
    biases: Array

    @property
    def taken(self) -> Taken:
        """What the gyroscope is taken for there."""
        return Taken(self.matrix, self.biases, self.sensitivity, self.bends)

    def stepped(self, step: Array) -> "State":
        from scipy.spatial.transform import Rotation

        of_rests = step[RESTS:].reshape(-1, 6)
        turned = np.asarray(Rotation.from_rotvec(of_rests[:, :3]).as_matrix(), dtype=np.float64)
        return replace(
            self,
            matrix=self.matrix + step[MATRIX].reshape(3, 3),
            sensitivity=self.sensitivity + step[GRAVITY].reshape(3, 3),
            bends=self.bends + step[BENDS],
            level=self.level + step[LEVEL].reshape(3, 3),
            offset=self.offset + step[OFFSET],
            table=self.table + step[TABLE],
            normals=self.normals + step[BOX].reshape(6, 2),
            attitudes=self.attitudes @ turned,
            biases=self.biases + of_rests[:, 3:],
        )


@dataclass(frozen=True)
class Factor:
    """Rows (r,) that `missed` what is expected, their `design` (r, p) so that missed + design δ is left, by causes.

    `causes` are the standard deviations (r,) of independent errors of the rows, by name; `at` is the rest or move.
    """

    kind: str
    at: int
    missed: Array
    design: Array
    causes: dict[str, Array]

    @cached_property
    def std(self) -> Array:
        return np.asarray(np.sqrt(sum(np.square(each) for each in self.causes.values())), dtype=np.float64)


@dataclass(frozen=True)
class Graph:
    """A session, on which faces, with what was told of it; where the solution is, and what the gyroscope says there."""

    session: Handled
    faced: Faced
    told: Told
    state: State
    moved: Moved
    sizes: Sizes

    @property
    def width(self) -> int:
        """How many parameters there are."""
        return RESTS + 6 * len(self.session.rests)

    @cached_property
    def between(self) -> Array:
        """(N − 1, 3, 3) attitude at the end of each move, in coordinates of its start."""
        return np.asarray(np.swapaxes(self.state.attitudes[:-1], -1, -2) @ self.state.attitudes[1:], dtype=np.float64)

    @cached_property
    def turned_rad(self) -> Array:
        """(N − 1, 3) rotation vectors of `between`."""
        return rotation_vectors(self.between)

    @cached_property
    def missed_rad(self) -> Array:
        """(N − 1, 3) rotation vectors by which the body turned more in each move, as the gyroscope says."""
        return rotation_vectors(self.moved.rotations @ np.swapaxes(self.between, -1, -2))

    @cached_property
    def noise_rad_s(self) -> float:
        """The scatter of a reading at rest."""
        return noise(self.session)

    @cached_property
    def walk_rad_sqrt_s(self) -> float:
        """The angle random walk, of the scatter at rest as white noise."""
        return self.noise_rad_s * float(np.sqrt(np.median(np.diff(self.session.time_s))))

    @cached_property
    def stamp_std_s(self) -> float:
        """The scatter of time stamps, of their second differences but for the largest, which gaps make.

        Stamps that are right and uneven cannot be told from even ones that are not.
        """
        apart = np.sort(np.abs(np.diff(self.session.time_s, 2)))
        return float(np.sqrt(np.mean(np.square(apart[: round(BUT_GAPS * len(apart))])) / 6))

    @cached_property
    def quiet_m_s2(self) -> float:
        """The scatter of an accelerometer's reading at the quietest of the rests."""
        scatter = [each.acceleration_noise_m_s2 for each in self.session.rests]
        return float(np.sqrt(np.min([np.mean(each**2) for each in scatter if each is not None])))


def factors(graph: Graph) -> Iterator[Factor]:
    """Every factor of the graph where it is."""
    session, faced = graph.session, graph.faced
    yield from _priors(graph)
    for row, move in enumerate(session.moves):
        if move.tells:
            yield _move(graph, row)
        if faced.turns[row]:
            yield _lean(graph, row)
            if graph.told.closure:
                yield _closure(graph, row)
        yield _bias_walk(graph, row)
    for row, rest in enumerate(session.rests):
        yield _rest(graph, row)
        if (face := faced.faces[row]) is not None:
            yield _flat(graph, row, FACES.index(face))
        if rest.acceleration_m_s2 is not None:
            yield _acceleration(graph, row)


def across(axis: Array) -> Array:
    """(2, 3) unit vectors at right angles to an axis (3,) and to each other."""
    turning = _skew(axis)
    first = turning[:, np.argmin(np.abs(axis))]
    first = first / np.linalg.norm(first)
    return np.array([first, turning @ first])


def noise(session: Handled) -> float:
    """The scatter of a reading at rest, rad/s: of all axes, and of the quieter half of the rests."""
    scatter = sorted(float(np.mean(rest.noise_rad_s**2)) for rest in session.rests)
    return float(np.sqrt(np.mean(scatter[: (len(scatter) + 1) // 2])))


def _held(scatter: Array, quiet: float, lasting_s: float) -> float:
    """What is left in the mean of a rest in which a hand held the body: it scatters more, and slowly."""
    beyond = float(np.mean(scatter**2)) - (AS_QUIET * quiet) ** 2
    return float(np.sqrt(max(beyond, 0.0) / max(HELD_HZ * lasting_s, 1.0)))


def _place(row: int) -> tuple[slice, slice]:
    """The columns of a rest's attitude and of its bias."""
    return slice(RESTS + 6 * row, RESTS + 6 * row + 3), slice(RESTS + 6 * row + 3, RESTS + 6 * row + 6)


def _move(graph: Graph, row: int) -> Factor:
    moved, sizes = graph.moved, graph.sizes
    design = np.zeros((3, graph.width))
    (first, first_bias), (second, second_bias) = _place(row), _place(row + 1)
    design[:, MATRIX], design[:, GRAVITY] = moved.by_matrix[row], moved.by_gravity[row]
    design[:, BENDS] = moved.by_bends[row]
    design[:, first_bias] = design[:, second_bias] = moved.by_bias[row] / 2
    design[:, first], design[:, second] = np.eye(3), -graph.between[row]
    causes = {
        "noise": np.full(3, graph.walk_rad_sqrt_s * np.sqrt(moved.durations_s[row])),
        "stamps": np.full(3, graph.stamp_std_s * moved.changes_rad_s[row]),
        "of_angle": np.full(3, sizes.of_angle * np.sqrt(QUARTER_RAD * moved.paths_rad[row])),
    }
    return Factor(MOVE, row, graph.missed_rad[row], design, causes)


def _lean(graph: Graph, row: int) -> Factor:
    state, moved, faced = graph.state, graph.moved, graph.faced
    up, angle = faced.up[row], float(faced.up[row] @ moved.swept_rad[row])
    ways = across(state.matrix @ up / np.linalg.norm(state.matrix @ up))
    design = np.zeros((2, graph.width))
    design[:, MATRIX] = -np.kron(ways, up)
    (_, first), (_, second) = _place(row), _place(row + 1)
    design[:, first] = design[:, second] = -ways * moved.durations_s[row] / angle / 2
    noisy = graph.walk_rad_sqrt_s * np.sqrt(moved.durations_s[row]) / abs(angle)
    causes = {"lean": np.full(2, LEAN_RAD), "noise": np.full(2, noisy)}
    return Factor(LEANING, row, ways @ (moved.swept_rad[row] / angle - state.matrix @ up), design, causes)


def _closure(graph: Graph, row: int) -> Factor:
    up = graph.faced.up[row]
    design = np.zeros((1, graph.width))
    design[0, _place(row)[0]], design[0, _place(row + 1)[0]] = -up, up @ graph.between[row]
    causes = {"closure": np.array([graph.sizes.closure_rad])}
    return Factor(CLOSURE, row, np.array([up @ graph.turned_rad[row]]), design, causes)


def _bias_walk(graph: Graph, row: int) -> Factor:
    session, state, sizes = graph.session, graph.state, graph.sizes
    first, second = session.rests[row], session.rests[row + 1]
    apart_s = (second.start_s + second.end_s - first.start_s - first.end_s) / 2
    design = np.zeros((3, graph.width))
    design[:, _place(row)[1]], design[:, _place(row + 1)[1]] = -np.eye(3), np.eye(3)
    causes = {"walk": np.full(3, sizes.walk_rad_s_sqrt_s * np.sqrt(apart_s))}
    return Factor(WALK, row, state.biases[row + 1] - state.biases[row], design, causes)


def _rest(graph: Graph, row: int) -> Factor:
    session, state = graph.session, graph.state
    rest, up = session.rests[row], state.attitudes[row][2]
    design = np.zeros((3, graph.width))
    design[:, _place(row)[1]], design[:, GRAVITY] = -np.eye(3), -np.kron(np.eye(3), up)
    causes = {
        "noise": np.full(3, graph.walk_rad_sqrt_s / np.sqrt(max(rest.end_s - rest.start_s, 1e-3))),
        "earth": np.full(3, EARTH_STD_RAD_S),
        "held": np.full(3, _held(rest.noise_rad_s, graph.noise_rad_s, rest.end_s - rest.start_s)),
    }
    return Factor(REST, row, rest.mean_rad_s - state.biases[row] - state.sensitivity @ up, design, causes)


def _flat(graph: Graph, row: int, face: int) -> Factor:
    state = graph.state
    axis, up = axis_of(FACES[face]), state.attitudes[row][2]
    ways = across(axis)
    design = np.zeros((2, graph.width))
    design[:, _place(row)[0]] = ways @ _skew(up)
    design[:, BOX.start + 2 * face : BOX.start + 2 * face + 2] = -np.eye(2)
    causes = {"repeat": np.full(2, graph.sizes.repeat_rad)}
    return Factor(FLAT, row, ways @ up - state.normals[face], design, causes)


def _acceleration(graph: Graph, row: int) -> Factor:
    session, state, told = graph.session, graph.state, graph.told
    rest = session.rests[row]
    assert rest.acceleration_m_s2 is not None and rest.acceleration_noise_m_s2 is not None
    up = told.gravity_m_s2 * np.array([*state.table, 1.0])
    felt = state.attitudes[row].T @ up
    design = np.zeros((3, graph.width))
    design[:, LEVEL], design[:, OFFSET] = -np.kron(np.eye(3), felt), -np.eye(3)
    design[:, _place(row)[0]] = -state.level @ _skew(felt)
    design[:, TABLE] = -told.gravity_m_s2 * state.level @ state.attitudes[row].T[:, :2]
    direction = felt / np.linalg.norm(felt)
    axes = np.vstack([across(direction), direction])
    missed = axes @ (rest.acceleration_m_s2 - state.level @ felt - state.offset)
    scatter = float(np.sqrt(np.mean(rest.acceleration_noise_m_s2**2) / max(rest.samples, 1)))
    causes = {
        "acceleration": np.full(3, graph.sizes.acceleration_m_s2),
        "acceleration noise": np.full(3, scatter),
        "held": np.full(3, _held(rest.acceleration_noise_m_s2, graph.quiet_m_s2, rest.end_s - rest.start_s)),
        "along": np.array([0.0, 0.0, ALONG_M_S2]),
    }
    return Factor(ACCELERATION, row, missed, axes @ design, causes)


def _priors(graph: Graph) -> Iterator[Factor]:
    state, told, width = graph.state, graph.told, graph.width

    def prior(name: str, columns: slice, missed: Array, std: float) -> Factor:
        return Factor(PRIOR, 0, missed, np.eye(width)[columns], {name: np.full(len(missed), std)})

    yield prior("matrix", MATRIX, (state.matrix - np.eye(3)).ravel(), MATRIX_STD)
    yield prior("g-sensitivity", GRAVITY, state.sensitivity.ravel(), SENSITIVITY_STD)
    yield prior("nonlinearity", BENDS, state.bends, NONLINEARITY / HAND_RAD_S)
    yield prior("level", LEVEL, (state.level - np.eye(3)).ravel(), LEVEL_STD)
    yield prior("level", OFFSET, state.offset, OFFSET_STD_M_S2)
    yield prior("table", TABLE, state.table, TABLE_STD_RAD)
    yield prior("box", BOX, state.normals.ravel(), told.box_rad)
    for row in (0, *(row + 1 for row, move in enumerate(graph.session.moves) if not move.tells)):
        design, at = np.zeros((1, width)), RESTS + 6 * row
        design[0, at : at + 3] = state.attitudes[row][2]
        yield Factor(PRIOR, row, np.zeros(1), design, {"heading": np.array([HEADING_STD_RAD])})
    yield prior("bias", slice(RESTS + 3, RESTS + 6), state.biases[0], BIAS_STD_RAD_S)


def _skew(vector: Array) -> Array:
    """The matrix (3, 3) that takes δ to vector × δ."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
