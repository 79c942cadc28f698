"""The simulated operator: reads an instruction, thinks, and handles the item on the table, now and then by mistake.

What is known here of an instruction is what its line of text and its drawing show: what to do, and with which side up.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rig.config.world.laboratory import WorldSection
from rig.world.clock import TICK_S
from rig.world.hand.habits import FACES, Action, Face, Flip, Habits, Mistake, Turn
from rig.world.hand.hand import Hand
from rig.world.magnetic_field import Frames
from rig.world.site import site_of
from rig.world.ur10e.motion.flange_motion import Components, Felt
from rig.world.ur10e.motion.forward_kinematics import Vector

BESIDE_S = 5e-4  # on either side of a moment, for how its rate changes
OF_ONE = {"short": "turn", "two_turns": "turn", "other_way": "turn", "wrong_face": "lay"}  # of others both
SKIPPED_S = 5.0  # until an instruction that was passed over is read again
ORIGIN: Vector = (0.0, 0.0, 0.0)
UNMOVED = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Operator:
    """A `Turning`. The same instructions at the same ticks are followed by the same motions."""

    ideal = False
    waiting = False  # it moves when its time has come
    tick_s = TICK_S

    def __init__(self, world: WorldSection) -> None:
        section, site = world.hand, site_of(world.site)
        self._section = section
        habits = Habits(
            peak_deg_s=section.peak_deg_s,
            wobble_deg=section.wobble_deg,
            tremor_deg=section.tremor_deg,
            tilt_mrad=section.tilt_mrad,
            closure_mrad=section.closure_mrad,
            faces_mrad=section.faces_mrad,
            table_mrad=section.table_mrad,
            lever_arm_m=ORIGIN,  # each sensor has its own place
            earth_rate_rad_s=site.earth_rate_rad_s,
            gravity_m_s2=world.site.gravity_m_s2,
        )
        self._hand = Hand(habits, world.seed)
        self._mind = np.random.default_rng([world.seed, 1])
        self._ticks = 0
        self._told: tuple[Action, float] | None = None  # what is to be done, and from when on
        self._acts = 0
        self._mistakes: list[str] = []
        self._lying: tuple[float, Felt] | None = None  # from when on it lies, and what is felt then

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick."""
        return self._ticks * TICK_S

    @property
    def state(self) -> dict[str, Any]:
        """How it goes on, for tests: what was done and which mistakes were made with it."""
        return {"face": self._hand.face, "acts": self._acts, "mistakes": self._mistakes}

    def instruct(self, say: str, face: Face, turns: int = 0, *, again: bool = False) -> None:
        """Read an instruction; a newer one takes the place of one that was not begun. ValueError for what is none.

        An item that lies as it should is let lie, unless the line says `again`.
        """
        if face not in FACES or say not in ("lay", "turn"):
            raise ValueError(f"there is no instruction {say!r} of a side {face!r}")
        if say == "lay" and face == self._hand.face and not again:
            self._told = None
            return
        thought_s = float(self._mind.uniform(*self._section.reaction_time_s))
        mistake = self._mistake(say)
        action: Action = Flip(face, mistake) if say == "lay" else Turn(int(turns), mistake)
        self._told = action, max(self.time_s, self._hand.lies_from_s) + thought_s

    def _mistake(self, say: str) -> Mistake | None:
        """The mistake that the next action is made with, mostly none."""
        drawn = float(self._mind.uniform())
        for kind, probability in self._section.mistakes.items():
            drawn -= probability
            if drawn < 0:
                return Mistake(kind) if OF_ONE.get(kind, say) == say else None
        return None

    def step(self) -> None:
        """One tick; what is to be done by now is begun."""
        self._ticks += 1
        if self._told is not None and self.time_s >= self._told[1]:
            action, self._told = self._told[0], None
            kind = None if action.mistake is None else action.mistake.kind
            if kind is not None:
                self._mistakes.append(kind)
            self._acts += 1
            self._hand.act(action, self.time_s)
            if kind == "skipped":  # the line stands there still
                self._told = replace(action, mistake=None), self.time_s + SKIPPED_S

    def rate_at(self, time_s: float) -> Components:
        """Angular rate of what is carried, rad/s, as `felt_at` has it: a hand is never ideal."""
        return self.felt_at(time_s).rate_rad_s

    def felt_at(self, time_s: float) -> Felt:
        """What a body in the hand, or on the table, feels; what a fall has done to its sensors is in it too."""
        lies_from_s = self._hand.lies_from_s + BESIDE_S
        if self._lying is not None and self._lying[0] == lies_from_s and time_s >= lies_from_s:
            return self._lying[1]
        felt = self._hand.felt_at(np.array([time_s - BESIDE_S, time_s, time_s + BESIDE_S]))
        change = (felt.rate_rad_s[2] - felt.rate_rad_s[0]) / (2 * BESIDE_S)
        rate = felt.rate_rad_s[1] + felt.gyro_bias_rad_s[1]
        force = felt.specific_force_m_s2[1] + felt.accelerometer_bias_m_s2[1]
        now = Felt(tuple(rate.tolist()), tuple(change.tolist()), tuple(force.tolist()))
        if time_s >= lies_from_s:
            self._lying = lies_from_s, now
        return now

    def frames_at(self, time_s: float) -> Frames:
        """The table, and the item on it."""
        x, y, z = map(tuple, self._hand.felt_at(np.array([time_s])).attitude[0].tolist())
        return [(UNMOVED, ORIGIN), ((x, y, z), ORIGIN)]
