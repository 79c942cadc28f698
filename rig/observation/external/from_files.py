"""A recording of external readings, from a file of them and, mostly, one of their motion."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from rig.config.column_map import ColumnMap, ColumnSection
from rig.data.installed_kinds import quantities
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE
from rig.data.recording.motion_file import TIME, Columns, Item, MotionKind, ReadElsewhere
from rig.data.recording.provenance import provenance_of_files
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import Elsewhere, ObservationThresholds, RunSettings, Site
from rig.errors import Refused
from rig.motion.turner_state import ARM_STATE_DTYPE
from rig.observation.external.attitude_import import read_attitudes
from rig.observation.external.csv_import import read_sweeps
from rig.observation.external.csv_samples import read_sample_table, samples_in
from rig.observation.external.table_log import read_table_log
from rig.observation.formats.csv_table import Mapped
from rig.observation.formats.sample_files import entry_of, whole

AS_NAMED_HERE = ColumnMap()
USED: Mapping[MotionKind, tuple[str, ...]] = {  # the sensors that the solution uses; all if none is named
    "sweeps": (RATE.sensor,),
    "turns": (RATE.sensor, ACCELERATION.sensor),
    "attitudes": (),
}
NOTHING_LOST = ObservationThresholds(max_lost_fraction=0.01, max_speed_deviation=0.01, max_axis_deviation_deg=10.0)


@dataclass(frozen=True, slots=True)
class Files:
    """The two files and their item; `recorded` None is the time at which the readings' file was last written.

    `columns` map columns that are not named as in the rig. For "turns" no file holds the motion: `motion` is what the
    user declared, by column.
    """

    readings: Path
    motion: Path | Columns
    tells: MotionKind
    item: Item
    recorded: datetime | None = None
    columns: ColumnMap = AS_NAMED_HERE


def build_recording(
    files: Files, site: Site, request: Elsewhere, *, second_order: bool = False, reference_c: float | None = None
) -> RunData:
    """Return the recording; with a reference temperature that of a calibration over temperature.

    Raise Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `time_not_increasing`.
    """
    column_map = files.columns
    needed = () if files.tells == "attitudes" else [RATE]
    mapped = _build_map(column_map.samples, column_map.samples_skip_lines)
    table = read_sample_table(files.readings, needed, mapped, request.only or USED[files.tells])
    samples = samples_in(table.columns, str(files.readings))  # as they will be solved
    if missing := [
        sensor for sensor in request.only if sensor not in {quantity.sensor for quantity in samples.readings}
    ]:
        raise Refused(
            "wrong_columns",
            f"{files.readings} holds no readings of the {missing[0]} that is to be calibrated",
            "Name its columns, or leave out --only",
        )
    names = [TIME, *(name for sensor in quantities().values() for name in sensor.columns)]
    names += TEMPERATURE.columns if reference_c is not None else ()
    columns = {name: table.columns[name] for name in names if name in table.columns}
    start = files.recorded or datetime.fromtimestamp(whole(files.readings).stat().st_mtime, UTC)
    motion = _motion(files, table.origin_s)
    read_elsewhere = ReadElsewhere(files.item, columns, files.tells, motion, table.origin_s, table.others)
    return RunData(
        config="",
        settings=RunSettings(
            procedure=files.tells,
            then_verify=False,
            observation=NOTHING_LOST,
            limits=None,
            to_calibrate=(files.item.name,),
            reference=None,
            home_q_rad=(),
            planned_sweeps=(),
            site=site,
            uncertainty=None,
            second_order=second_order,
            elsewhere=request,
            reference_c=reference_c,
        ),
        provenance=provenance_of_files(
            entry_of(files.readings),
            entry_of(files.motion) if isinstance(files.motion, Path) else None,
            files.item,
            start,
        ),
        sensors={files.item.name: read_elsewhere.sensor},
        samples={files.item.name: read_elsewhere.samples},
        turner=None,
        states=np.empty(0, ARM_STATE_DTYPE),
        events=(),
        external=read_elsewhere,
    )


def _motion(files: Files, origin_s: int) -> Columns:
    """Return the motion by column, times from `origin_s` on.

    Raise Refused as its readers do, and `bad_option` for a table's log of sweeps.
    """
    column_map = files.columns
    if not isinstance(files.motion, Path):
        return files.motion
    if column_map.table is not None:
        if files.tells == "sweeps":
            raise Refused("bad_option", "the columns are those of a table's log", "Give that log with --attitudes")
        return read_table_log(files.motion, column_map.table, column_map.motion_skip_lines, origin_s)
    read: Callable[[Path, Mapped | None, int], Columns] = read_sweeps if files.tells == "sweeps" else read_attitudes
    return read(files.motion, _build_map(column_map.motion, column_map.motion_skip_lines), origin_s)


def _build_map(columns: Mapping[str, ColumnSection], skip_lines: int) -> Mapped | None:
    """Return the map of a file's columns; None without one: then an unknown column is an error."""
    if not columns and not skip_lines:
        return None
    return Mapped({name: (section.column, section.factor) for name, section in columns.items()}, skip_lines)
