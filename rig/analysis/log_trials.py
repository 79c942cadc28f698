"""Attempts to solve another program's log, for the suggestions of `rig look`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.analysis.analyses import calibrate
from rig.config.column_map import ColumnMap
from rig.data.quantity import RATE
from rig.data.recording.motion_file import Item
from rig.data.recording.settings import Site, SolveOptions
from rig.errors import RigError
from rig.estimation.arrays import axis_of
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.observation.by_hand.steadiness import check_at_rest
from rig.observation.external.csv_samples import Samples
from rig.observation.external.from_files import Files, build_recording


def find_allan_obstacle(samples: Samples) -> RigError | None:
    """Return the error that says why a log does not show a sensor at rest; None if it does."""
    try:
        for quantity, readings in samples.readings.items():
            check_at_rest(samples.time_s, readings, quantity)
    except RigError as error:
        return error
    return None


@dataclass(frozen=True, slots=True)
class Trial:
    """An attempt to solve the sensors named in `only`, all if empty; `obstacle` says why it failed, None if not."""

    only: tuple[str, ...] = ()
    obstacle: str | None = None


def try_turns(path: Path, column_map: ColumnMap) -> Trial:
    """Return an attempt to solve a log as that of a sensor turned by hand (`--turns`)."""
    options = {
        "clock_ppm": 50.0,
        "box_rad": float(np.radians(0.2)),
        "closure": 1.0,
        "gravity_m_s2": STANDARD_GRAVITY_M_S2,
    }
    motion = {name: np.array([value]) for name, value in options.items()}
    files = Files(path, motion, "turns", Item("imu"), None, column_map)
    return Trial(obstacle=_find_obstacle(files, SolveOptions(), "+z"))


def try_attitudes(
    path: Path, reference: Path, column_map: ColumnMap, up: str, *, find_clock: bool, sensors: Sequence[str]
) -> Trial:
    """Return an attempt to solve all sensors of a log in a reference's attitudes; if it fails, the gyroscope alone."""
    files = Files(path, reference, "attitudes", Item("imu"), None, column_map)
    trial = Trial()
    for only in ((), (RATE.sensor,)) if len(sensors) > 1 and RATE.sensor in sensors else ((),):
        options = SolveOptions(any_mounting=True, find_clock=find_clock, only=only)
        trial = Trial(only, _find_obstacle(files, options, up))
        if trial.obstacle is None:
            return trial
    return trial


def _find_obstacle(files: Files, request: SolveOptions, up: str) -> str | None:
    """Return why the files have no solution, if the axis `up` points upwards, or which checks fail; None if none."""
    x, y, z = axis_of(up).tolist()
    site = Site(up=(x, y, z), gravity_m_s2=STANDARD_GRAVITY_M_S2, earth_rate_rad_s=None)
    try:
        outcome = calibrate([build_recording(files, site, request)])
    except RigError as error:
        return str(error).rstrip(".")
    failed = [check.name for check in outcome.checks if not check.passed]
    return f"checks fail: {', '.join(failed)}" if failed else None
