"""The hand itself: it does one thing after another with a body, which lies still in between."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.world.hand.course import (
    STEP_S,
    HandCourse,
    integrate_course,
    rotate_about_horizontal,
    simulate_holding,
    simulate_move,
    simulate_nudge,
)
from rig.world.hand.habits import FACES, Action, Face, FlipAction, Habits, Mistake, TurnAction, WaitAction
from rig.world.hand.rotations import Array, find_shortest_rotation, rotation_from_rotvec, rotvec_from_rotation

GRAVITY_M_S2 = 9.81
MG = 1e-3 * GRAVITY_M_S2
DROP_M_S2 = 160.0  # what a drop is felt by


@dataclass(frozen=True, slots=True)
class HandMotion:
    """What a sensor on the body would feel at times (n,): rate and specific force (n, 3) in body axes.

    Beside them attitudes (n, 3, 3) body to room, what a fall has added to the biases (n, 3), and whether the reading
    is lost (n,).
    """

    rate_rad_s: Array
    specific_force_m_s2: Array
    attitude: Array
    gyro_bias_rad_s: Array
    accelerometer_bias_m_s2: Array
    lost: NDArray[np.bool_]


class SimulatedHand:
    """A body that lies on a table with the axis `face` upwards from time 0 on, and is handled from there.

    Nothing but `seed` decides what is drawn, action for action.
    """

    def __init__(self, habits: Habits, seed: int) -> None:
        self.habits = habits
        self.face: Face = "+z"
        self.lies_from_s = 0.0
        self._rng = rng = np.random.default_rng(seed)
        self._normals = {
            name: _axis(name) @ rotation_from_rotvec(1e-3 * habits.faces_mrad * rng.normal(size=3)) for name in FACES
        }
        self._table = rotate_about_horizontal(1e-3 * habits.table_mrad * rng.normal(size=2))
        self._courses: list[HandCourse] = []
        self._lost_s: list[tuple[float, float]] = []
        self._fell: list[tuple[float, Array, Array]] = []  # from when on, and by what the biases have jumped
        self._attitude = self._laid(rotation_from_rotvec(rng.uniform(-3, 3) * np.array([0.0, 0.0, 1.0])), self.face)
        self._add(integrate_course(self._attitude, np.array([-STEP_S, 0.0]), np.zeros((2, 3)), habits), 0.0)

    def act(self, action: Action, start_s: float) -> float:
        """Does it from `start_s` on; returns when it is done. ValueError where the action before has not ended."""
        if start_s < self.lies_from_s:
            raise ValueError(f"the hand is busy until {self.lies_from_s:.2f} s")
        mistake = action.mistake
        match mistake.kind if mistake is not None else None:
            case "left":
                start_s += mistake.sized if mistake else 0.0
            case "lifted":
                start_s = self._lifted(start_s, mistake.sized if mistake else 0.0) + 1.5
            case "skipped":
                self.lies_from_s = start_s
                return start_s
            case _:
                pass
        match action:
            case WaitAction(seconds):
                self.lies_from_s = start_s + seconds
            case FlipAction(to):
                self._flip(self._another(to) if mistake and mistake.kind == "wrong_face" else to, start_s, mistake)
            case TurnAction(turns):
                self._turn(turns, start_s, mistake)
        return self.lies_from_s

    def motion_at(self, time_s: Array) -> HandMotion:
        """What is felt at times (n,) in any order; before 0 and after the last action it lies still."""
        time_s = np.asarray(time_s, dtype=np.float64)
        starts = np.array([course.time_s[0] for course in self._courses])
        which = np.searchsorted(starts, time_s, side="right").clip(1) - 1
        rate, force, attitude = (np.zeros((len(time_s), *shape)) for shape in ((3,), (3,), (3, 3)))
        for number in np.unique(which):
            there, course = which == number, self._courses[number]
            at_s = time_s[there]
            for axis in range(3):
                rate[there, axis] = np.interp(at_s, course.time_s, course.rates[:, axis])
                force[there, axis] = np.interp(at_s, course.time_s, course.forces[:, axis])
            nearest = np.searchsorted(course.time_s, at_s).clip(0, len(course.time_s) - 1)
            attitude[there] = course.attitudes[nearest]
        rate += (np.swapaxes(attitude, -1, -2) @ np.asarray(self.habits.earth_rate_rad_s)[:, None])[..., 0]
        jumps = np.zeros((2, len(time_s), 3))
        for since_s, gyroscope, accelerometer in self._fell:
            jumps += (time_s >= since_s)[None, :, None] * np.array([gyroscope, accelerometer])[:, None]
        lost = np.zeros(len(time_s), dtype=np.bool_)
        for start_s, end_s in self._lost_s:
            lost |= (time_s >= start_s) & (time_s < end_s)
        return HandMotion(rate, force, attitude, jumps[0], jumps[1], lost)

    def _flip(self, to: Face, start_s: float, mistake: Mistake | None) -> None:
        up = self._attitude[2]  # the vertical in body axes
        heading = rotation_from_rotvec(1e-3 * self.habits.heading_mrad * self._rng.normal() * np.array([0.0, 0.0, 1.0]))
        target = heading @ self._attitude @ find_shortest_rotation(self._normals[to], up)
        self._go(self._laid(target, to, mistake), None, start_s, mistake)
        self.face = to

    def _turn(self, turns: int, start_s: float, mistake: Mistake | None) -> None:
        kind = mistake.kind if mistake is not None else None
        turns = {"two_turns": 2 * turns, "other_way": -turns}.get(str(kind), turns)
        off = 1e-3 * self.habits.closure_mrad * self._rng.normal()
        if mistake is not None and kind == "short":
            off -= np.sign(turns) * np.radians(mistake.sized)
        upwards = np.array([0.0, 0.0, 1.0])
        target = rotation_from_rotvec(off * upwards) @ self._attitude
        about = (2 * np.pi * turns + off) * self._attitude.T @ upwards
        self._go(self._laid(target, self.face, mistake), about, start_s, mistake)

    def _go(self, target: Array, about: Array | None, start_s: float, mistake: Mistake | None) -> None:
        """Moves it to the attitude `target`, by `about` (3,) in body axes where that is not the shortest way."""
        habits, kind = self.habits, mistake.kind if mistake is not None else None
        size = mistake.sized if mistake is not None else 0.0
        if kind == "too_fast":
            habits = replace(habits, peak_deg_s=size * habits.peak_deg_s)
        if kind == "held":
            target = target @ rotation_from_rotvec(np.radians(8.0) * self._rng.normal(size=3))
        vector = rotvec_from_rotation(self._attitude.T @ target) if about is None else about
        time_s, rates = simulate_move(self._attitude, target, vector, habits, self._rng)
        knock = habits.gravity_m_s2 * self._rng.uniform(*habits.knock_g)
        if kind == "dropped":
            knock = DROP_M_S2
            ways = self._rng.choice([-1.0, 1.0], (2, 3))
            fell_s = start_s + float(time_s[-1]) - 0.1
            self._fell.append((fell_s, np.radians(size) / np.sqrt(3) * ways[0], 10 / np.sqrt(3) * MG * ways[1]))
        course = integrate_course(self._attitude, time_s, rates, habits, 0.0 if kind == "held" else knock)
        end_s = self._add(course, start_s)
        if kind == "cable_pulled":
            middle_s = float(self._rng.uniform(0.4, 0.6)) * (end_s - start_s) + start_s
            self._lost_s.append((middle_s - size / 2, middle_s + size / 2))
        if kind == "held":
            self._add(integrate_course(self._attitude, *simulate_holding(size, habits, self._rng), habits), end_s)

    def _lifted(self, start_s: float, angle_deg: float) -> float:
        """Lifts it by a corner and lets it down again; returns when it lies."""
        away = np.radians(angle_deg) * self._attitude.T @ np.array([1.0, 0.0, 0.0])
        end_s = self._add(integrate_course(self._attitude, *simulate_nudge(away, 0.4), self.habits), start_s + 0.7)
        back = rotvec_from_rotation(self._attitude.T @ self._laid(self._attitude, self.face))
        return self._add(integrate_course(self._attitude, *simulate_nudge(back, 0.4), self.habits), end_s)

    def _laid(self, about: Array, face: Face, mistake: Mistake | None = None) -> Array:
        """(3, 3) body to room with its face on the table, headed as in `about` (3, 3)."""
        if mistake is not None and mistake.kind == "table_pushed":
            self._table = rotation_from_rotvec(1e-3 * mistake.sized * self._across()) @ self._table
        lying = self._table @ rotation_from_rotvec(
            1e-3 * self.habits.tilt_mrad * np.array([*self._rng.normal(size=2), 0.0])
        )
        if mistake is not None and mistake.kind == "crumb":
            lying = rotation_from_rotvec(1e-3 * mistake.sized * self._across()) @ lying
        return np.asarray(find_shortest_rotation(about @ self._normals[face], lying[:, 2]) @ about, dtype=np.float64)

    def _across(self) -> Array:
        """(3,) a unit vector in the horizontal."""
        way = self._rng.uniform(0, 2 * np.pi)
        return np.array([np.cos(way), np.sin(way), 0.0])

    def _another(self, face: Face) -> Face:
        return FACES[int(self._rng.choice([i for i, name in enumerate(FACES) if name not in (face, self.face)]))]

    def _add(self, course: HandCourse, start_s: float) -> float:
        self._courses.append(replace(course, time_s=course.time_s + start_s))
        self._attitude = course.attitudes[-1]
        self.lies_from_s = float(self._courses[-1].time_s[-1])
        return self.lies_from_s


def _axis(face: Face) -> Array:
    return np.asarray((1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])], dtype=np.float64)
