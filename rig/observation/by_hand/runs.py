"""From recordings of a session by hand to its rests and moves: what was refused while it went on ties no rests."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.events import Event
from rig.data.recording.hand_events import HandBegunAnew, HandMoveRefused, HandRestRefused
from rig.data.recording.provenance import Provenance
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.by_hand.session import (
    HandRecording,
    Move,
    Rest,
    SessionConditions,
    axis_of,
    merge_moves,
    nearest_face,
)
from rig.motion.by_hand import FACES, Face
from rig.observation.by_hand.handled import Segmenter
from rig.observation.timebase import NOMINAL_DRIFT, check_readings

BETWEEN_S = 10.0  # of nothing between two recordings of a session, whose boards' clocks do not tell it
MICROSECOND_S = 1e-6 * (1 + NOMINAL_DRIFT)  # of the board's counter, by its crystal
ITS_OWN_CLOCK = "the sensor's own clock, as stated: uncertainty.crystal_ppm"

Readings = tuple[Array, Array, Array | None]  # times (n,), rates (n, 3), accelerations (n, 3) where they are sent


def microsecond_of(sensor: RecordedSensor) -> float:
    """How long the microsecond of a sensor's time stamps is, s: the board's counter has its own."""
    return MICROSECOND_S if sensor.on_board else 1e-6


def readings_of(sensor: RecordedSensor, samples: NDArray[np.void], from_s: float = 0.0) -> Readings:
    """Samples (n,) by the crystal that stamps them, shifted by `from_s`, in SI units."""
    time_s = from_s + microsecond_of(sensor) * samples["board_time_us"].astype(np.float64)
    force = sensor.channel(ACCELERATION).values(samples) if sensor.measures(ACCELERATION) else None
    return time_s, sensor.channel(RATE).values(samples), force


def range_of(sensor: RecordedSensor) -> float | None:
    """The largest rate that a sensor reads, rad/s, where its part says it."""
    rate = sensor.channel(RATE)
    return None if rate.full_scale_counts is None else rate.full_scale_counts * rate.unit_per_count


@dataclass(slots=True)
class NotCounted:
    """What of a session does not count, in the session's seconds.

    `moves` and `rests` from when to when each went on, `seams` in the middle between two recordings, and from when on
    anything counts at all. Events tell it in microseconds of `microsecond_s`.
    """

    moves: list[tuple[float, float]] = field(default_factory=list)
    rests: list[tuple[float, float]] = field(default_factory=list)
    seams: list[float] = field(default_factory=list)
    from_s: float = -inf
    microsecond_s: float = MICROSECOND_S

    def take(self, event: Event, shift_s: float) -> None:
        """An event of a recording whose board's clock is so much behind the session's."""
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

    def without(self, session: HandRecording) -> HandRecording:
        """The session without it: a rest that does not count is a pause of the move that goes on through it."""
        rests, moves, through = list[Rest](), list[Move](), list[Move]()
        for place, rest in enumerate(session.rests):
            if _middle(rest) < self.from_s:
                continue
            if rests:
                through.append(self._judged(session.moves[place - 1]))
            if any(rest.start_s < end_s and start_s < rest.end_s for start_s, end_s in self.rests):
                continue
            if rests:
                moves.append(merge_moves(through))
                through.clear()
            rests.append(rest)
        return replace(session, rests=tuple(rests), moves=tuple(moves))

    def _judged(self, move: Move) -> Move:
        crosses = any(move.start_s <= seam_s <= move.end_s for seam_s in self.seams)
        return replace(move, left_out=True) if crosses or _within(move, self.moves) else move


def _middle(part: Rest | Move) -> float:
    return (part.start_s + part.end_s) / 2


def _within(part: Rest | Move, spans: Sequence[tuple[float, float]]) -> bool:
    return any(start_s <= _middle(part) <= end_s for start_s, end_s in spans)


def segmented(runs: Sequence[RunData], name: str) -> tuple[Segmenter, NotCounted, float]:
    """A session's rests and moves so far by one sensor, what of them does not count, and when it may go on.

    The item may have been anywhere between two recordings: the way from the last rest of one to the first of the next
    ties nothing. Raises Fault as `check_readings` does.
    """
    microsecond_s, ends_s = microsecond_of(runs[0].sensors[name]), None
    segmenter, refused = Segmenter(range_of(runs[0].sensors[name])), NotCounted(microsecond_s=microsecond_s)
    for run in runs:
        samples = run.samples[name]
        if not len(samples):
            continue
        board_s = microsecond_s * samples["board_time_us"][[0, -1]].astype(np.float64)
        shift_s = 0.0 if ends_s is None else ends_s + BETWEEN_S - board_s[0]
        if ends_s is not None:
            refused.seams.append(ends_s + BETWEEN_S / 2)
        readings = readings_of(run.sensors[name], samples, shift_s)
        time_s, *measured = readings
        check_readings(time_s, np.column_stack([each for each in measured if each is not None]))
        segmenter.feed(*readings)
        ends_s = shift_s + board_s[1]
        for recorded in run.events:
            refused.take(recorded.event, shift_s)
    return segmenter, refused, 0.0 if ends_s is None else float(ends_s)


def session_of(runs: Sequence[RunData], name: str) -> HandRecording:
    """A session's rests and moves by one sensor, as they are solved."""
    segmenter, refused, _ = segmented(runs, name)
    return refused.without(segmenter.handled)


def told_of(settings: RunSettings, provenance: Provenance, sensor: RecordedSensor) -> SessionConditions:
    """What the solution of a session needs to know besides a sensor's readings. Raises Refused `clock_unknown`.

    The clock that stamps the readings is the only measure of time there is, and no reading shows that it is wrong.
    Where no accelerometer reads which side is up, it is the one that is asked for first.
    """
    said, known = settings.by_hand, settings.uncertainty
    if said is None or known is None or (sensor.on_board and not provenance.board_follows_crystal):
        raise Refused(
            "clock_unknown",
            "the board's clock does not follow its crystal, so it may be a per cent off, and nothing in a session by "
            "hand can show that",
            "Look at the board's crystal (`rig board info`); a bridge on the Nucleo connects it",
        )
    first = None if sensor.measures(ACCELERATION) else turned_face(FACES[0], np.array(sensor.mounting))
    return SessionConditions(
        clock_ppm=known.crystal_ppm,
        clock_source="the board's crystal" if sensor.on_board else ITS_OWN_CLOCK,
        box_rad=said.box_rad,
        first_face=first,
        gravity_m_s2=settings.site.gravity_m_s2,
    )


def turned_face(face: str, rotation: Array) -> Face:
    """The face whose axis is that of `face` after a `rotation` (3, 3) to other axes, as near as they have one."""
    name = nearest_face(rotation @ axis_of(face))
    return next(each for each in FACES if each == name)
