"""A recorded run: its sensors' readings, and the rig's results."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rig.analysis.outcome import Outcome
from rig.config.column_map import MAP_REMEDY, STANDARD_NAMES, ColumnMap
from rig.config.load import load_as
from rig.data.latest_run import meant_run
from rig.data.recording.provenance import Provenance
from rig.data.recording.settings import RunSettings
from rig.notebook.html import table
from rig.notebook.readings import HEADINGS, NoSuchSensor, Readings
from rig.observation.external.from_files import read_log as read_external_log
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.plans.recorded_run import RecordedRun, judge_phases, open_run


@dataclass(frozen=True, eq=False)
class Run(Mapping[str, Readings]):
    """A recorded run: `run["gyro"]` are a sensor's readings.

    `verification` is the following movement with calibrated readings, if there is one.
    """

    recorded: RecordedRun

    @property
    def path(self) -> Path:
        """The run folder, or the run file."""
        return self.recorded.path

    @property
    def settings(self) -> RunSettings:
        """The settings by which the run is judged."""
        return self.recorded.movement[0].settings

    @property
    def provenance(self) -> Provenance:
        """The equipment and the times of the measurement."""
        return self.recorded.movement[0].provenance

    @property
    def verification(self) -> "Run | None":
        """The movement with calibrated readings, if one followed the calibration."""
        recorded = self.recorded
        if not (recorded.raw and recorded.corrected):
            return None
        return Run(RecordedRun(recorded.path, (), recorded.corrected, alone=True))

    @cached_property
    def calibration(self) -> Outcome | None:
        """The outcome of the raw readings alone; None without raw readings."""
        return judge_phases(self.recorded.only_raw()) if self.recorded.raw else None

    @cached_property
    def corrected(self) -> tuple[ObservedRun, ...]:
        """The recordings of readings corrected by the board."""
        return observe_runs(self.recorded.corrected) if self.recorded.corrected else ()

    def to_dict(self) -> dict[str, Any]:
        """Return the recording's description and settings as plain numbers, lists and texts, without the samples."""
        sensors = {name: readings.to_dict() for name, readings in self.items()}
        return {"path": str(self.path), "settings": self.settings.document(), "sensors": sensors}

    @cached_property
    def _readings(self) -> Mapping[str, Readings]:
        recordings = self.recorded.movement
        return {name: Readings(name, sensor, recordings) for name, sensor in recordings[0].sensors.items()}

    def __getitem__(self, name: str) -> Readings:
        if name not in self._readings:
            choices = f"Choose one of: {', '.join(self._readings)}" if self._readings else "Give a run that an arm made"
            raise NoSuchSensor("no_such_sensor", f"{self.path} has no samples of a sensor {name}", choices)
        return self._readings[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._readings)

    def __len__(self) -> int:
        return len(self._readings)

    def __repr__(self) -> str:
        return f"<run {self.path.name}: {self.settings.procedure}, {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        title = f"{self.path.name}: {self.settings.procedure}, {self.provenance.started_utc}"
        return table(title, HEADINGS, [readings.row() for readings in self.values()])


def load(path: str | Path, script: str | Path | None = None) -> Run:
    """Load a run folder or a run file, without executing foreign code in the folder.

    `latest` is your last run. `script`, the script of another user's recording, is executed. Raise Refused `no_run`,
    `no_latest_run`, and what `read_run` and `load_script` raise.
    """
    return Run(open_run(meant_run(path), None if script is None else Path(script)))


def read_log(path: str | Path, columns: str | Path | None = None) -> Readings:
    """Read a log of another program (CSV, a bag, `.ulg` or `.mat`) as `rig solve` does.

    `columns` is a file as for `rig solve --columns`, needed for a log with other names of columns or other units than
    SI. Raise Fault and Refused as `rig solve` does.
    """
    column_map = STANDARD_NAMES if columns is None else load_as(ColumnMap, columns, MAP_REMEDY)
    recording = read_external_log(Path(path), column_map)
    ((name, sensor),) = recording.sensors.items()
    return Readings(name, sensor, [recording])
