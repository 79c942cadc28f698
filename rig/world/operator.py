"""The simulated operator: reads an instruction, reacts, and handles the item on the table, now and then by mistake.

The operator knows only what the text and drawing of an instruction show: what to do, and with which side up.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rig.config.world.laboratory import WorldSection
from rig.world.clock import TICK_S
from rig.world.hand.habits import FACES, Action, Face, FlipAction, Habits, Mistake, TurnAction
from rig.world.hand.hand import SimulatedHand
from rig.world.magnetic_field import Frames
from rig.world.site import build_site
from rig.world.ur10e.motion.flange_motion import BodyMotion, Components
from rig.world.ur10e.motion.forward_kinematics import Vector

DIFFERENCE_S = 5e-4  # half the interval of the central difference of the rate
MISTAKE_ACTION = {"short": "turn", "two_turns": "turn", "other_way": "turn", "wrong_face": "lay"}  # others: both
REREADING_S = 5.0  # time until a skipped instruction is read again
ORIGIN: Vector = (0.0, 0.0, 0.0)
ORIENTATION = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class SimulatedOperator:
    """The simulated operator as a `MotionSource`. The same instructions at the same ticks give the same motions."""

    ideal = False
    waiting = False  # the hand moves by itself
    tick_s = TICK_S

    def __init__(self, world: WorldSection) -> None:
        section, site = world.hand, build_site(world.site)
        self._section = section
        habits = Habits(
            peak_deg_s=section.peak_deg_s,
            wobble_deg=section.wobble_deg,
            tremor_deg=section.tremor_deg,
            tilt_mrad=section.tilt_mrad,
            closure_mrad=section.closure_mrad,
            faces_mrad=section.faces_mrad,
            table_mrad=section.table_mrad,
            lever_arm_m=ORIGIN,  # every sensor has its own position
            earth_rate_rad_s=site.earth_rate_rad_s,
            gravity_m_s2=world.site.gravity_m_s2,
        )
        self._hand = SimulatedHand(habits, world.seed)
        self._mind = np.random.default_rng([world.seed, 1])
        self._ticks = 0
        self._pending: tuple[Action, float] | None = None  # the next action and its start, s
        self._acts = 0
        self._mistakes: list[str] = []
        self._resting: tuple[float, BodyMotion] | None = None  # start of a rest, s, and the motion in it

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick, s."""
        return self._ticks * TICK_S

    @property
    def state(self) -> dict[str, Any]:
        """The operator's progress, for tests: the side up, the number of actions, and the mistakes made."""
        return {"face": self._hand.face, "acts": self._acts, "mistakes": self._mistakes}

    def instruct(
        self, say: str, face: Face, turns: int = 0, *, again: bool = False, mistake: Mistake | None = None
    ) -> None:
        """Give the operator an instruction, which replaces a pending one.

        It is carried out with the given `mistake`, or with one drawn at random if None. An item that already lies as
        requested is left alone, unless `again`. Raise ValueError for an unknown instruction.
        """
        if face not in FACES or say not in ("lay", "turn"):
            raise ValueError(f"there is no instruction {say!r} of a side {face!r}")
        if say == "lay" and face == self._hand.face and not again:
            self._pending = None
            return
        thought_s = float(self._mind.uniform(*self._section.reaction_time_s))
        mistake = mistake or self._draw_mistake(say)
        action: Action = FlipAction(face, mistake) if say == "lay" else TurnAction(int(turns), mistake)
        self._pending = action, max(self.time_s, self._hand.lies_from_s) + thought_s

    def _draw_mistake(self, say: str) -> Mistake | None:
        """Return the mistake of the next action, drawn at random; mostly None."""
        draw = float(self._mind.uniform())
        for kind, probability in self._section.mistakes.items():
            draw -= probability
            if draw < 0:
                return Mistake(kind) if MISTAKE_ACTION.get(kind, say) == say else None
        return None

    def step(self) -> None:
        """Simulate one tick, and begin the action that is due."""
        self._ticks += 1
        if self._pending is not None and self.time_s >= self._pending[1]:
            action, self._pending = self._pending[0], None
            kind = None if action.mistake is None else action.mistake.kind
            if kind is not None:
                self._mistakes.append(kind)
            self._acts += 1
            self._hand.act(action, self.time_s)
            if kind == "skipped":  # the instruction is still displayed
                self._pending = replace(action, mistake=None), self.time_s + REREADING_S

    def rate_at(self, time_s: float) -> Components:
        """Return the item's angular rate, rad/s."""
        return self.motion_at(time_s).rate_rad_s

    def motion_at(self, time_s: float) -> BodyMotion:
        """Return the motion of the item, including bias jumps of its sensors after a fall."""
        lies_from_s = self._hand.lies_from_s + DIFFERENCE_S
        if self._resting is not None and self._resting[0] == lies_from_s and time_s >= lies_from_s:
            return self._resting[1]
        hand = self._hand.motion_at(np.array([time_s - DIFFERENCE_S, time_s, time_s + DIFFERENCE_S]))
        change = (hand.rate_rad_s[2] - hand.rate_rad_s[0]) / (2 * DIFFERENCE_S)
        rate = hand.rate_rad_s[1] + hand.gyro_bias_rad_s[1]
        force = hand.specific_force_m_s2[1] + hand.accelerometer_bias_m_s2[1]
        now = BodyMotion(tuple(rate.tolist()), tuple(change.tolist()), tuple(force.tolist()))
        if time_s >= lies_from_s:
            self._resting = lies_from_s, now
        return now

    def frames_at(self, time_s: float) -> Frames:
        """Return the frames of the table and of the item."""
        x, y, z = map(tuple, self._hand.motion_at(np.array([time_s])).attitude[0].tolist())
        return [(ORIENTATION, ORIGIN), ((x, y, z), ORIGIN)]
