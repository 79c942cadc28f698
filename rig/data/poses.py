"""Whether the poses of a recording are its turner's."""

from collections.abc import Iterable

from rig.data.events import DwellFinished, DwellStarted, Recorded, SweepFinished, SweepStarted
from rig.data.recorded_turner import RecordedTurner
from rig.data.settings import RunSettings
from rig.motion.state import Joints


def check_joints(turner: RecordedTurner, settings: RunSettings, events: Iterable[Recorded]) -> None:
    """Raises ValueError where a pose of a recording has other joints than its turner."""
    poses: list[Joints] = [settings.home_q_rad, *(each.q_rad for each in settings.planned_dwells)]
    for event in (recorded.event for recorded in events):
        if isinstance(event, SweepStarted | SweepFinished):
            poses += [event.sweep.start_q_rad, event.sweep.end_q_rad]
        if isinstance(event, DwellStarted | DwellFinished):
            poses.append(event.dwell.q_rad)
    if any(len(pose) != len(turner.joints) for pose in poses):
        raise ValueError(f"its turner has {len(turner.joints)} joints, and one of its poses has another number")
