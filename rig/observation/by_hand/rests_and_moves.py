"""The rests and moves of a session by hand, from its recordings, without refused moves."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.hand_events import HandBegunAnew, HandMoveRefused, HandRestRefused
from rig.data.recording.provenance import Provenance
from rig.data.recording.recorded_events import Event
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import Refused
from rig.estimation.arrays import Array, axis_of
from rig.estimation.by_hand.session_parts import (
    HandRecording,
    HandRest,
    Move,
    SessionConditions,
    merge_moves,
    nearest_face,
)
from rig.motion.by_hand import FACES, Face
from rig.observation.by_hand.hand_segmentation import Segmenter
from rig.observation.clocks.clock_estimate import check_readings
from rig.observation.clocks.time_base import NOMINAL_DRIFT

RECORDING_PAUSE_S = 10.0  # assumed between two recordings of a session: the boards' clocks do not show it
MICROSECOND_S = 1e-6 * (1 + NOMINAL_DRIFT)  # true duration of a microsecond of the board's counter
OWN_CLOCK_SOURCE = "the sensor's own clock, as stated: uncertainty.crystal_ppm"

Readings = tuple[Array, Array, Array | None]  # times (n,), rates (n, 3), accelerations (n, 3) where they are sent


def microsecond_of(sensor: RecordedSensor) -> float:
    """Return the true duration, s, of a microsecond of a sensor's time stamps; a board's clock is not exact."""
    return MICROSECOND_S if sensor.on_board else 1e-6


def readings_of(sensor: RecordedSensor, samples: NDArray[np.void], from_s: float = 0.0) -> Readings:
    """Return samples (n,) in SI units; their times are their time stamps in true seconds, plus `from_s`."""
    time_s = from_s + microsecond_of(sensor) * samples["board_time_us"].astype(np.float64)
    force = sensor.channel(ACCELERATION).values(samples) if sensor.measures(ACCELERATION) else None
    return time_s, sensor.channel(RATE).values(samples), force


def range_of(sensor: RecordedSensor) -> float | None:
    """Return the largest rate that a sensor can read, rad/s; None if its part does not state one."""
    rate = sensor.channel(RATE)
    return None if rate.full_scale_counts is None else rate.full_scale_counts * rate.unit_per_count


@dataclass(slots=True)
class NotCounted:
    """The parts of a session that are left out, in the session's seconds.

    - `moves`, `rests`: the intervals of refused moves and rests.
    - `seams`: the middles of the gaps between recordings.
    - `from_s`: the time before which everything is left out.
    - `microsecond_s`: the true duration, s, of a microsecond of the sensor's clock, because events use that clock.
    """

    moves: list[tuple[float, float]] = field(default_factory=list)
    rests: list[tuple[float, float]] = field(default_factory=list)
    seams: list[float] = field(default_factory=list)
    from_s: float = -inf
    microsecond_s: float = MICROSECOND_S

    def take(self, event: Event, shift_s: float) -> None:
        """Leave out the move or rest that an `event` reports as refused.

        If the event reports that the session begins anew, leave out everything before that time. The clock of the
        event's recording is `shift_s` behind the session's.
        """
        match event:
            case HandMoveRefused(begin_us, end_us):
                self.moves.append(self._span_s(begin_us, end_us, shift_s))
            case HandRestRefused(begin_us, end_us):
                self.rests.append(self._span_s(begin_us, end_us, shift_s))
            case HandBegunAnew(begin_us):
                self.from_s = shift_s + self.microsecond_s * begin_us
            case _:
                pass

    def _span_s(self, begin_us: int, end_us: int, shift_s: float) -> tuple[float, float]:
        return shift_s + self.microsecond_s * begin_us, shift_s + self.microsecond_s * end_us

    def filter_session(self, session: HandRecording) -> HandRecording:
        """Return the session without the refused `rests`, and with the refused `moves` marked.

        The moves before and after a refused rest are merged into one move, which contains a pause.
        """
        rests, moves, through = list[HandRest](), list[Move](), list[Move]()
        for index, rest in enumerate(session.rests):
            if _middle_s(rest) < self.from_s:
                continue
            if rests:
                through.append(self._mark_move(session.moves[index - 1]))
            if any(rest.start_s < end_s and start_s < rest.end_s for start_s, end_s in self.rests):
                continue
            if rests:
                moves.append(merge_moves(through))
                through.clear()
            rests.append(rest)
        return replace(session, rests=tuple(rests), moves=tuple(moves))

    def _mark_move(self, move: Move) -> Move:
        crosses = any(move.start_s <= seam_s <= move.end_s for seam_s in self.seams)
        return replace(move, left_out=True) if crosses or _is_within(move, self.moves) else move


def _middle_s(part: HandRest | Move) -> float:
    return (part.start_s + part.end_s) / 2


def _is_within(part: HandRest | Move, spans: Sequence[tuple[float, float]]) -> bool:
    return any(start_s <= _middle_s(part) <= end_s for start_s, end_s in spans)


def replay_runs(runs: Sequence[RunData], name: str) -> tuple[Segmenter, NotCounted, float]:
    """Return the segmentation of one sensor's readings so far, the parts to leave out, and the end of the readings, s.

    The end is a time of the session, at which another recording may continue. The item may have been moved between two
    recordings, so no move connects the rests of different recordings. Raise Fault as `check_readings` does.
    """
    microsecond_s, ends_s = microsecond_of(runs[0].sensors[name]), None
    segmenter, refused = Segmenter(range_of(runs[0].sensors[name])), NotCounted(microsecond_s=microsecond_s)
    for run in runs:
        samples = run.samples[name]
        if not len(samples):
            continue
        board_s = microsecond_s * samples["board_time_us"][[0, -1]].astype(np.float64)
        shift_s = 0.0 if ends_s is None else ends_s + RECORDING_PAUSE_S - board_s[0]
        if ends_s is not None:
            refused.seams.append(ends_s + RECORDING_PAUSE_S / 2)
        readings = readings_of(run.sensors[name], samples, shift_s)
        time_s, *measured = readings
        check_readings(time_s, np.column_stack([values for values in measured if values is not None]))
        segmenter.feed(*readings)
        ends_s = shift_s + board_s[1]
        for recorded in run.events:
            refused.take(recorded.event, shift_s)
    return segmenter, refused, 0.0 if ends_s is None else float(ends_s)


def session_of(runs: Sequence[RunData], name: str) -> HandRecording:
    """Return a session's rests and moves as one sensor recorded them, for the solution."""
    segmenter, refused, _ = replay_runs(runs, name)
    return refused.filter_session(segmenter.handled)


def collect_inputs(settings: RunSettings, provenance: Provenance, sensor: RecordedSensor) -> SessionConditions:
    """Return the inputs of a session's solution other than a sensor's readings.

    One input is the face that is up at first: None if an accelerometer shows this face, otherwise the face that was
    requested first. Raise Refused `clock_unknown` if the error of the clock that stamps the readings is not stated.
    """
    by_hand, uncertainty = settings.by_hand, settings.uncertainty
    if by_hand is None or uncertainty is None or (sensor.on_board and not provenance.board_follows_crystal):
        raise clock_unknown()
    first = None if sensor.measures(ACCELERATION) else rotate_face(FACES[0], np.array(sensor.mounting))
    return SessionConditions(
        clock_ppm=uncertainty.crystal_ppm,
        clock_source="the board's crystal" if sensor.on_board else OWN_CLOCK_SOURCE,
        box_rad=by_hand.box_rad,
        first_face=first,
        gravity_m_s2=settings.site.gravity_m_s2,
    )


def clock_unknown() -> Refused:
    """Return the error for a board whose clock does not follow its crystal."""
    return Refused(
        "clock_unknown",
        "the board's clock does not follow its crystal, so it may be 1 % off, which a session by hand cannot show",
        "Look at the board's crystal (`rig board info`); a bridge on the Nucleo connects it",
    )


def rotate_face(face: str, rotation: Array) -> Face:
    """Return the face, in other axes, whose direction is nearest to that of `face`.

    `rotation` (3, 3) converts vectors to the other axes.
    """
    name = nearest_face(rotation @ axis_of(face))
    return next(candidate for candidate in FACES if candidate == name)
