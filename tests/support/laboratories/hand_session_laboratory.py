"""A session by hand in virtual time: the simulated operator at the table, a sensor in the hand, no board."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rig.config.world.laboratory import WorldSection
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.channel import triad_channel
from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandEvent,
    HandMoveAccepted,
    HandMoveRefused,
    HandRestRefused,
)
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import HandSettings
from rig.estimation.arrays import Array, scale_of
from rig.estimation.by_hand import HandSolution, SessionConditions, solve_by_hand
from rig.estimation.by_hand.session_parts import HandRecording
from rig.observation.by_hand.hand_segmentation import Segmenter
from rig.observation.by_hand.rests_and_moves import NotCounted, range_of, readings_of
from rig.observation.clocks.time_base import NOMINAL_DRIFT
from rig.runner.acquisition import Acquisition
from rig.runner.by_hand.hand_session import HandSession
from rig.world.hand.habits import Mistake
from rig.world.operator import SimulatedOperator

RATE_HZ, LOOK_S, LONGEST_S = 119.0, 0.2, 400.0
PER_COUNT, PER_COUNT_M_S2 = float(np.radians(0.0175)), 5.98e-4
CHANNELS = (
    triad_channel(RATE, PER_COUNT, 32767, np.radians(500)),
    triad_channel(ACCELERATION, PER_COUNT_M_S2, 32767, 19.6),
)
SENSOR = RecordedSensor("lsm9ds1", "LSM9DS1-HAND", RATE_HZ, CHANNELS)
MATRIX = np.array([[0.85, 0.003, -0.002], [0.001, 0.865, 0.004], [0.002, -0.001, 0.874]])  # F of m = F ω + c
OFFSET, NOISE = np.array([0.0077, -0.01, -0.005]), 1.0e-3
CREEP_RAD_S = np.radians([0.2, -0.15, 0.1])
CONDITIONS = SessionConditions(50.0, "the board's crystal")
LIST = HandSettings(flips=12, turns=3, rest_s=1.0, box_rad=float(np.radians(0.2)), closure_rad=float(np.radians(0.3)))


@dataclass
class Table:
    """A session: its `events` in their order.

    The operator makes the mistake `in_turn` in the first turn. In the rest number `creeps` the item turns slowly. The
    accelerometer's readings times `force_sign` are its usual ones.
    """

    seed: int
    mistakes: dict[str, float] = field(default_factory=dict)
    settings: HandSettings = LIST
    hand: dict[str, Any] = field(default_factory=dict)
    creeps: int | None = None
    in_turn: Mistake | None = None
    force_sign: float = 1.0
    events: list[HandEvent] = field(default_factory=list)
    time_s: float = 0.0

    def __post_init__(self) -> None:
        sensors = {"gyro": {"scale": [1, 1, 1], "bias_rad_s": [0, 0, 0]}}
        hand = {"mistakes": self.mistakes, **self.hand}
        self.operator = SimulatedOperator(
            WorldSection.model_validate({"seed": self.seed, "sensors": sensors, "hand": hand})
        )
        self._random = np.random.default_rng([self.seed, 7])
        self.samples: list[np.ndarray] = []
        self._count = self._laid_down = 0
        self._still, self._crept = False, 0
        self.acquisition = Acquisition()
        self.acquisition.expect("gyro", SENSOR)
        self.session = HandSession(
            self.acquisition, self._note, lambda event: None, self.settings, "gyro", SENSOR, CONDITIONS, wait=self._pass
        )

    def sit(self) -> None:
        """Execute the session. Raise its Fault, or TimeoutError if it does not end."""
        self.session.carry_out(lambda: None)

    @property
    def handled(self) -> HandRecording:
        """The session's rests and moves as found by the analysis, without refused ones."""
        segmenter, not_counted = Segmenter(range_of(SENSOR)), NotCounted()
        segmenter.feed(*readings_of(SENSOR, np.concatenate(self.samples)))
        for event in self.events:
            not_counted.take(event, 0.0)
        return not_counted.filter_session(segmenter.handled)

    @property
    def solution(self) -> HandSolution:
        """The solution of the session."""
        return solve_by_hand(self.handled, CONDITIONS)

    @property
    def again(self) -> list[str]:
        """The names of the errors after which a move was requested again."""
        refused = (HandMoveRefused, HandRestRefused, HandBegunAnew)
        return [event.again for event in self.events if isinstance(event, refused)]

    @property
    def reminded(self) -> list[str]:
        """The names of the reminders to repeat an action."""
        return [event.again for event in self.events if isinstance(event, HandAsked) and event.again is not None]

    @property
    def accepted(self) -> list[HandMoveAccepted]:
        """The accepted moves."""
        return [event for event in self.events if isinstance(event, HandMoveAccepted)]

    def _note(self, event: HandEvent) -> None:
        self.events.append(event)
        if isinstance(event, HandAsked):
            instruction = event.instruction
            mistake, again = (self.in_turn if instruction.say == "turn" else None), event.again is not None
            self.operator.instruct(instruction.say, instruction.face, instruction.turns, again=again, mistake=mistake)
            self.in_turn = None if instruction.say == "turn" else self.in_turn

    def _pass(self, _: float) -> None:
        """Let time pass, in which readings arrive."""
        count = round(LOOK_S * RATE_HZ)
        times = self.time_s + np.arange(1, count + 1) / RATE_HZ
        motions = []
        for time_s in times.tolist():
            while self.operator.time_s < time_s:
                self.operator.step()
            motions.append(self.operator.motion_at(time_s))
        self.time_s = float(times[-1])
        if self.time_s > LONGEST_S:
            raise TimeoutError("the session has no end")
        samples = np.zeros(count, SENSOR.sample_dtype)
        samples["sequence"] = self._count + np.arange(count)
        samples["board_time_us"] = np.round(1e6 * (times + 100.0) / (1 + NOMINAL_DRIFT))
        samples["host_time_s"] = times + 1.0
        true_rates = np.array([motion.rate_rad_s for motion in motions])
        rates = (true_rates + self._creeping(true_rates)) @ MATRIX.T + OFFSET
        forces = self.force_sign * np.array([motion.force_m_s2 for motion in motions])
        self._fill(samples, RATE, rates + self._random.normal(0, NOISE, rates.shape), PER_COUNT)
        self._fill(samples, ACCELERATION, forces + self._random.normal(0, 0.02, forces.shape), PER_COUNT_M_S2)
        self._count += count
        self.samples.append(samples)
        self.acquisition.on_samples("gyro", samples)

    def _creeping(self, rates: Array) -> Array:
        """Return the slow rotation (n, 3) of the item in one rest, and its reversal when the hand takes it up."""
        turning = np.zeros_like(rates)
        for row, still in enumerate(not rate.any() for rate in rates):
            self._laid_down += still and not self._still
            self._still = still
            if still and self._laid_down == self.creeps:
                turning[row] = CREEP_RAD_S
                self._crept += 1
            elif not still:
                turning[row], self._crept = -self._crept * CREEP_RAD_S, 0
        return turning

    @staticmethod
    def _fill(samples: np.ndarray, quantity: Any, values: Array, per_count: float) -> None:
        samples[SENSOR.channel(quantity).column] = np.clip(np.round(values / per_count), -32767, 32767)


TRUE_SCALE = scale_of(MATRIX)
