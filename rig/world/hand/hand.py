"""The hand itself: it performs one action after another with a body, which rests in between."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.world.hand.course import STEP_S, HandCourse, build_course, hold, move, nudge, tilt
from rig.world.hand.habits import FACES, Action, Face, FlipAction, Habits, Mistake, TurnAction, WaitAction
from rig.world.hand.rotations import Array, align_vectors, exp_map, log_map

GRAVITY_M_S2 = 9.81
MG = 1e-3 * GRAVITY_M_S2
DROP_M_S2 = 160.0  # peak specific force of a drop


@dataclass(frozen=True, slots=True)
class HandMotion:
    """The motion sensed on the body at n times, in body axes.

    Rates, specific forces and biases are arrays (n, 3); a bias is the sum of the jumps that falls of the body have
    caused so far. Attitudes (n, 3, 3) rotate from the body to the room, and `lost` (n,) marks the readings that are
    lost.
    """

    rate_rad_s: Array
    specific_force_m_s2: Array
    attitude: Array
    gyro_bias_rad_s: Array
    accelerometer_bias_m_s2: Array
    lost: NDArray[np.bool_]


class SimulatedHand:
    """A body that rests on a table at time 0, with the axis `face` upwards, and is then handled.

    All random draws follow from `seed`, so the same actions at the same times give the same motions.
    """

    def __init__(self, habits: Habits, seed: int) -> None:
        self.habits = habits
        self.face: Face = "+z"
        self.lies_from_s = 0.0
        self._rng = rng = np.random.default_rng(seed)
        self._normals = {name: _axis(name) @ exp_map(1e-3 * habits.faces_mrad * rng.normal(size=3)) for name in FACES}
        self._table = tilt(1e-3 * habits.table_mrad * rng.normal(size=2))
        self._courses: list[HandCourse] = []
        self._lost_s: list[tuple[float, float]] = []
        # Times of falls, s, and the jumps of the bias of both triads.
        self._bias_jumps: list[tuple[float, Array, Array]] = []
        self._attitude = self._find_rest_attitude(exp_map(rng.uniform(-3, 3) * np.array([0.0, 0.0, 1.0])), self.face)
        self._add(build_course(self._attitude, np.array([-STEP_S, 0.0]), np.zeros((2, 3)), habits), 0.0)

    def act(self, action: Action, start_s: float) -> float:
        """Perform the action that begins at `start_s`; return its end, s. Raise ValueError during another action."""
        if start_s < self.lies_from_s:
            raise ValueError(f"the hand is busy until {self.lies_from_s:.2f} s")
        mistake = action.mistake
        match mistake.kind if mistake is not None else None:
            case "left":
                start_s += mistake.magnitude if mistake else 0.0
            case "lifted":
                start_s = self._lift(start_s, mistake.magnitude if mistake else 0.0) + 1.5
            case "skipped":
                self.lies_from_s = start_s
                return start_s
            case _:
                pass
        match action:
            case WaitAction(seconds):
                self.lies_from_s = start_s + seconds
            case FlipAction(to):
                face = self._draw_other_face(to) if mistake and mistake.kind == "wrong_face" else to
                self._flip(face, start_s, mistake)
            case TurnAction(turns):
                self._turn(turns, start_s, mistake)
        return self.lies_from_s

    def motion_at(self, time_s: Array) -> HandMotion:
        """Return the motion at times (n,) in any order. The body rests before 0 and after the last action."""
        time_s = np.asarray(time_s, dtype=np.float64)
        starts = np.array([course.time_s[0] for course in self._courses])
        course_index = np.searchsorted(starts, time_s, side="right").clip(1) - 1
        rate, force, attitude = (np.zeros((len(time_s), *shape)) for shape in ((3,), (3,), (3, 3)))
        for index in np.unique(course_index):
            mask, course = course_index == index, self._courses[index]
            times_s = time_s[mask]
            for axis in range(3):
                rate[mask, axis] = np.interp(times_s, course.time_s, course.rates[:, axis])
                force[mask, axis] = np.interp(times_s, course.time_s, course.forces[:, axis])
            nearest = np.searchsorted(course.time_s, times_s).clip(0, len(course.time_s) - 1)
            attitude[mask] = course.attitudes[nearest]
        rate += (np.swapaxes(attitude, -1, -2) @ np.asarray(self.habits.earth_rate_rad_s)[:, None])[..., 0]
        jumps = np.zeros((2, len(time_s), 3))
        for fall_s, gyroscope, accelerometer in self._bias_jumps:
            jumps += (time_s >= fall_s)[None, :, None] * np.array([gyroscope, accelerometer])[:, None]
        lost = np.zeros(len(time_s), dtype=np.bool_)
        for start_s, end_s in self._lost_s:
            lost |= (time_s >= start_s) & (time_s < end_s)
        return HandMotion(rate, force, attitude, jumps[0], jumps[1], lost)

    def _flip(self, to: Face, start_s: float, mistake: Mistake | None) -> None:
        up = self._attitude[2]  # the vertical in body axes
        heading = exp_map(1e-3 * self.habits.heading_mrad * self._rng.normal() * np.array([0.0, 0.0, 1.0]))
        target = heading @ self._attitude @ align_vectors(self._normals[to], up)
        self._go(self._find_rest_attitude(target, to, mistake), None, start_s, mistake)
        self.face = to

    def _turn(self, turns: int, start_s: float, mistake: Mistake | None) -> None:
        """Turn the body about the vertical by whole `turns`, with the hand's error and a possible mistake."""
        kind = mistake.kind if mistake is not None else None
        turns = {"two_turns": 2 * turns, "other_way": -turns}.get(str(kind), turns)
        error_rad = 1e-3 * self.habits.closure_mrad * self._rng.normal()
        if mistake is not None and kind == "short":
            error_rad -= np.sign(turns) * np.radians(mistake.magnitude)
        upwards = np.array([0.0, 0.0, 1.0])
        target = exp_map(error_rad * upwards) @ self._attitude
        vector = (2 * np.pi * turns + error_rad) * self._attitude.T @ upwards
        self._go(self._find_rest_attitude(target, self.face, mistake), vector, start_s, mistake)

    def _go(self, target: Array, vector: Array | None, start_s: float, mistake: Mistake | None) -> None:
        """Move the body to the attitude `target`, by the rotation `vector` (3,) or, if None, on the shortest path."""
        habits, kind = self.habits, mistake.kind if mistake is not None else None
        size = mistake.magnitude if mistake is not None else 0.0
        if kind == "too_fast":
            habits = replace(habits, peak_deg_s=size * habits.peak_deg_s)
        if kind == "held":
            target = target @ exp_map(np.radians(8.0) * self._rng.normal(size=3))
        vector = log_map(self._attitude.T @ target) if vector is None else vector
        time_s, rates = move(self._attitude, target, vector, habits, self._rng)
        knock = habits.gravity_m_s2 * self._rng.uniform(*habits.knock_g)
        if kind == "dropped":
            knock = DROP_M_S2
            signs = self._rng.choice([-1.0, 1.0], (2, 3))
            fell_s = start_s + float(time_s[-1]) - 0.1
            self._bias_jumps.append((fell_s, np.radians(size) / np.sqrt(3) * signs[0], 10 / np.sqrt(3) * MG * signs[1]))
        course = build_course(self._attitude, time_s, rates, habits, 0.0 if kind == "held" else knock)
        end_s = self._add(course, start_s)
        if kind == "cable_pulled":
            middle_s = float(self._rng.uniform(0.4, 0.6)) * (end_s - start_s) + start_s
            self._lost_s.append((middle_s - size / 2, middle_s + size / 2))
        if kind == "held":
            self._add(build_course(self._attitude, *hold(size, habits, self._rng), habits), end_s)

    def _lift(self, start_s: float, angle_deg: float) -> float:
        """Lift the body by a corner and put it down again; return the end, s."""
        lift = np.radians(angle_deg) * self._attitude.T @ np.array([1.0, 0.0, 0.0])
        end_s = self._add(build_course(self._attitude, *nudge(lift, 0.4), self.habits), start_s + 0.7)
        descent = log_map(self._attitude.T @ self._find_rest_attitude(self._attitude, self.face))
        return self._add(build_course(self._attitude, *nudge(descent, 0.4), self.habits), end_s)

    def _find_rest_attitude(self, attitude: Array, face: Face, mistake: Mistake | None = None) -> Array:
        """Return the attitude (3, 3), body to room, with `face` upwards and the heading of `attitude` (3, 3)."""
        if mistake is not None and mistake.kind == "table_pushed":
            self._table = exp_map(1e-3 * mistake.magnitude * self._draw_horizontal()) @ self._table
        lying = self._table @ exp_map(1e-3 * self.habits.tilt_mrad * np.array([*self._rng.normal(size=2), 0.0]))
        if mistake is not None and mistake.kind == "crumb":
            lying = exp_map(1e-3 * mistake.magnitude * self._draw_horizontal()) @ lying
        return np.asarray(align_vectors(attitude @ self._normals[face], lying[:, 2]) @ attitude, dtype=np.float64)

    def _draw_horizontal(self) -> Array:
        """Return a horizontal unit vector, (3,), drawn at random."""
        angle = self._rng.uniform(0, 2 * np.pi)
        return np.array([np.cos(angle), np.sin(angle), 0.0])

    def _draw_other_face(self, face: Face) -> Face:
        return FACES[int(self._rng.choice([i for i, name in enumerate(FACES) if name not in (face, self.face)]))]

    def _add(self, course: HandCourse, start_s: float) -> float:
        self._courses.append(replace(course, time_s=course.time_s + start_s))
        self._attitude = course.attitudes[-1]
        self.lies_from_s = float(self._courses[-1].time_s[-1])
        return self.lies_from_s


def _axis(face: Face) -> Array:
    return np.asarray((1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])], dtype=np.float64)
