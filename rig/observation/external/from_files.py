"""A recording of external readings, from a file of readings and usually a second file with the sensor's motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from rig.config.column_map import STANDARD_NAMES, ColumnMap
from rig.data.installed_kinds import quantities
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE
from rig.data.recording.motion_file import TIME, Columns, ExternalReadings, Item, MotionKind
from rig.data.recording.provenance import Provenance, provenance_of_files
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds, RunSettings, Site, SolveOptions
from rig.errors import Refused
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.observation.external.attitude_import import read_attitudes
from rig.observation.external.csv_import import read_sweeps
from rig.observation.external.csv_samples import read_sample_table, samples_in
from rig.observation.external.table_log import read_table_log
from rig.observation.formats.column_selection import map_motion, map_samples
from rig.observation.formats.sample_files import entry_of, whole

UNNAMED_ITEM = Item("imu")
USED_SENSORS: Mapping[MotionKind, tuple[str, ...]] = {  # the sensors that the solution uses; all, if none is named
    "sweeps": (RATE.sensor,),
    "turns": (RATE.sensor, ACCELERATION.sensor),
    "attitudes": (),
}
THRESHOLDS = ObservationThresholds(max_lost_fraction=0.01, max_speed_deviation=0.01, max_axis_deviation_deg=10.0)


@dataclass(frozen=True, slots=True)
class Files:
    """The file of `readings`, the file of the motion, and the item that was turned.

    - `tells`: the kind of motion, "sweeps", "attitudes" or "turns". For "turns" there is no file of the motion;
      `motion` then holds the user's declarations, by column.
    - `recorded`: the time of recording, None for the time at which the readings' file was last written.
    - `columns`: a map of columns with other names than the rig's.
    """

    readings: Path
    motion: Path | Columns
    tells: MotionKind
    item: Item
    recorded: datetime | None = None
    columns: ColumnMap = STANDARD_NAMES


def build_recording(
    files: Files, site: Site, request: SolveOptions, *, second_order: bool = False, reference_c: float | None = None
) -> RunData:
    """Return the contents of the files as a recording that can be solved with the options `request`.

    If `second_order`, the accelerometer's model has terms of second order. If the reference temperature `reference_c`
    is given, the solution is over temperature. Raise Refused `no_file`, `wrong_columns`, `wrong_unit`,
    `not_a_number`, and as `check_times` does.
    """
    column_map = files.columns
    needed = () if files.tells == "attitudes" else [RATE]
    mapped = map_samples(column_map)
    table = read_sample_table(files.readings, needed, mapped, request.only or USED_SENSORS[files.tells])
    samples = samples_in(table.columns, str(files.readings))  # as the solution will use them
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
    external = ExternalReadings(files.item, columns, files.tells, motion, table.origin_s, table.others, table.note)
    return _recording(
        external,
        RunSettings(
            procedure=files.tells,
            then_verify=False,
            observation=THRESHOLDS,
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
        provenance_of_files(
            entry_of(files.readings),
            entry_of(files.motion) if isinstance(files.motion, Path) else None,
            files.item,
            start,
        ),
    )


def read_log(path: Path, columns: ColumnMap = STANDARD_NAMES, item: Item = UNNAMED_ITEM) -> RunData:
    """Return the readings of a file without motion, as `rig solve` reads them, to be shown or exported.

    Raise Refused as `read_sample_table` and `samples_in` do.
    """
    table = read_sample_table(path, (), map_samples(columns))
    samples_in(table.columns, str(path))
    external = ExternalReadings(item, table.columns, "turns", {}, table.origin_s, table.others, table.note)
    written = datetime.fromtimestamp(whole(path).stat().st_mtime, UTC)
    settings = RunSettings(
        procedure="turns",
        then_verify=False,
        observation=THRESHOLDS,
        limits=None,
        to_calibrate=(),
        reference=None,
        home_q_rad=(),
        planned_sweeps=(),
        site=Site(up=(0.0, 0.0, 1.0), gravity_m_s2=STANDARD_GRAVITY_M_S2, earth_rate_rad_s=None),
        uncertainty=None,
        second_order=False,
        elsewhere=None,
        reference_c=None,
    )
    return _recording(external, settings, provenance_of_files(entry_of(path), None, item, written))


def _recording(read: ExternalReadings, settings: RunSettings, provenance: Provenance) -> RunData:
    return RunData(
        config="",
        settings=settings,
        provenance=provenance,
        sensors={read.item.name: read.sensor},
        samples={read.item.name: read.samples},
        turner=None,
        states=np.empty(0, ARM_STATE_DTYPE),
        events=(),
        external=read,
    )


def _motion(files: Files, origin_s: int) -> Columns:
    """Return the motion by column, with times that count from `origin_s`.

    Raise Refused as the readers of motion do, and `bad_option` if a rate table's log is given as sweeps.
    """
    column_map = files.columns
    if not isinstance(files.motion, Path):
        return files.motion
    if column_map.table is not None:
        if files.tells == "sweeps":
            raise Refused("bad_option", "the columns are those of a table's log", "Give that log with --attitudes")
        return read_table_log(files.motion, column_map.table, column_map, origin_s)
    mapped = map_motion(column_map)
    if files.tells == "sweeps":
        return read_sweeps(files.motion, mapped, origin_s)
    return read_attitudes(files.motion, mapped, origin_s, inverse=column_map.motion_inverse)
