"""The description of the turner in a run file, and the rows of its states."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from rig.data.recording.recorded_events import DwellFinished, DwellStarted, SweepFinished, SweepStarted, TimedEvent
from rig.data.recording.settings import RunSettings
from rig.data.validation import parse_json, validate
from rig.motion.chain import MAX_JOINTS, DenavitHartenberg
from rig.motion.state_rows import StateField, state_dtype
from rig.motion.turner_state import Joints, TurnerIdentity

MAX_FIELDS = 32
REQUIRED = ("time_s", "host_time_s", "q_rad", "qd_rad_s")
Kind = Annotated[str, Field(pattern=r"^\w[\w.-]*$", max_length=40)]
Word = Annotated[str, Field(max_length=200)]
JointName = Annotated[str, Field(pattern=r"^\w[\w -]*$", max_length=40)]  # becomes the name of a column


@dataclass(frozen=True)
class RecordedTurner:
    """A turner: its `kind`, by which it is registered, its maker and its model (None if unknown).

    - `joints`: the names of its joints, at most `MAX_JOINTS`, beginning at the ground.
    - `geometry`: the geometry of the chain of joints.
    - `fields`: the fields of its states other than times and joints.
    - `reading_std_rad`: the standard deviation of one reading of a joint's angle, 0 if negligible.
    """

    kind: Kind
    maker: Word
    model: Word | None
    joints: Annotated[tuple[JointName, ...], Field(max_length=MAX_JOINTS)]
    geometry: DenavitHartenberg
    fields: Annotated[tuple[StateField, ...], Field(max_length=MAX_FIELDS)] = ()
    reading_std_rad: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0

    @classmethod
    def build(
        cls, kind: str, model: TurnerIdentity, joints: Sequence[str], fields: Sequence[StateField]
    ) -> "RecordedTurner":
        """Return a turner of the given kind and model, whose states have these fields. Raise ValueError."""
        motion = tuple(joints), model.kinematics, tuple(fields), model.reading_std_rad
        return parse_turner(asdict(cls(kind, model.maker, model.model, *motion)))

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """The type of the rows of its states."""
        return state_dtype(len(self.joints), self.fields)

    def to_json(self) -> str:
        """Return the description as in a run file."""
        return json.dumps(asdict(self), allow_nan=False)


def parse_turner(document: Any) -> RecordedTurner:
    """Return the turner that a document describes. Raise ValueError naming the impossible value."""
    turner = validate(RecordedTurner, document, "turner")
    names = [field.name for field in turner.fields]
    if len({*turner.joints}) < len(turner.joints) or len({*names, *REQUIRED}) < len(names) + len(REQUIRED):
        raise ValueError("two joints of its turner, or two fields of its states, have one name")
    if not all(name.isascii() and name.isidentifier() and len(name) <= 40 for name in names):
        raise ValueError("a field of its turner's states has a name that is not allowed")
    if turner.geometry.joints != len(turner.joints):
        raise ValueError(f"its turner has {len(turner.joints)} joints but a geometry of {turner.geometry.joints}")
    return turner


def turner_of(text: str) -> RecordedTurner:
    """Return the turner that `RecordedTurner.to_json` wrote. Raise ValueError naming the error."""
    return parse_turner(parse_json(text))


def check_joints(turner: RecordedTurner, settings: RunSettings, events: Iterable[TimedEvent]) -> None:
    """Raise ValueError if a pose and its turner have different numbers of joints."""
    poses: list[Joints] = [settings.home_q_rad, *(dwell.q_rad for dwell in settings.planned_dwells)]
    for event in (recorded.event for recorded in events):
        if isinstance(event, SweepStarted | SweepFinished):
            poses += [event.sweep.start_q_rad, event.sweep.end_q_rad]
        if isinstance(event, DwellStarted | DwellFinished):
            poses.append(event.dwell.q_rad)
    if any(len(pose) != len(turner.joints) for pose in poses):
        raise ValueError(f"its turner has {len(turner.joints)} joints, but one of its poses has another number")
