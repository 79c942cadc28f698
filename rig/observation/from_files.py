"""A recording of readings that were made elsewhere, from a file of them and one that tells their motion."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from rig.data.motion_file import Columns, Item, ReadElsewhere, Told
from rig.data.provenance import provenance_of_files
from rig.data.quantity import RATE
from rig.data.run_file import RunData
from rig.data.settings import RECKONING, Elsewhere, ObservationThresholds, RunSettings, Site
from rig.motion.state import ARM_STATE_DTYPE
from rig.observation.attitude_import import read_attitudes
from rig.observation.csv_import import read_sweeps
from rig.observation.csv_samples import read_samples
from rig.observation.sample_files import entry_of, whole

NOTHING_LOST = ObservationThresholds(max_lost_fraction=0.01, max_speed_deviation=0.01, max_axis_deviation_deg=10.0)


@dataclass(frozen=True, slots=True)
class Files:
    """The two files, and whose readings they hold; `recorded` None is when the readings' file was last written."""

    readings: Path
    motion: Path
    tells: Told
    item: Item
    recorded: datetime | None = None


def recorded_in_files(files: Files, site: Site, asked: Elsewhere, *, second_order: bool = False) -> RunData:
    """The recording. Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `time_not_increasing`."""
    read: Callable[[Path], Columns] = read_sweeps if files.tells == "sweeps" else read_attitudes
    samples = read_samples(files.readings, [RATE] if files.tells == "sweeps" else ())
    columns = {"time_s": samples.time_s} | {
        name: readings[:, i]
        for quantity, readings in samples.readings.items()
        for i, name in enumerate(quantity.columns)
    }
    began = files.recorded or datetime.fromtimestamp(whole(files.readings).stat().st_mtime, UTC)
    read_elsewhere = ReadElsewhere(files.item, columns, files.tells, read(files.motion))
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
            second_order=second_order,
            reckoning=RECKONING,
            elsewhere=asked,
        ),
        provenance=provenance_of_files(entry_of(files.readings), entry_of(files.motion), files.item, began),
        sensors={files.item.name: read_elsewhere.sensor},
        samples={files.item.name: read_elsewhere.samples},
        turner=None,
        states=np.empty(0, ARM_STATE_DTYPE),
        events=(),
        elsewhere=read_elsewhere,
    )
