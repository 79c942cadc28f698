"""A run as it was recorded: its sensors' readings in rad/s on the arm's clock."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.analysis.calibration import DEFAULT_ESTIMATOR
from rig.analysis.outcome import Outcome
from rig.data.provenance import Provenance
from rig.data.quantity import RATE
from rig.data.recorded_sensor import RecordedSensor
from rig.data.run_file import RunData
from rig.data.settings import RunSettings
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.notebook.html import table
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.plans.recorded import RecordedRun, judged, open_run

if TYPE_CHECKING:
    from rig.notebook.plots import Plot

HEADINGS = ("sensor", "part", "serial number", "Hz", "samples", "readings")


class NoSuchSensor(Refused, KeyError):
    """There is no sensor of that name; a KeyError as well, so that `name in run` and `run.get(name)` work."""


@dataclass(frozen=True, eq=False)
class Readings:
    """One sensor's readings in all recordings of a movement, in the order they were made."""

    name: str
    sensor: RecordedSensor
    recordings: Sequence[RunData]

    def on_arm_clock(self) -> tuple[Array, Array]:
        """Controller times (n,) in s and readings (n, 3) in rad/s; of readings from files, their file's times.

        Raises Fault as `estimate_time_base` does.
        """
        return self._on_arm_clock

    @cached_property
    def _on_arm_clock(self) -> tuple[Array, Array]:
        from rig.observation.arm_motion import motion_of
        from rig.observation.average import on_the_arms_clock

        if any(run.elsewhere is not None for run in self.recordings):
            samples = self.samples
            return samples["host_time_s"], self.sensor.channel(RATE).values(samples)
        streams = [on_the_arms_clock(run.samples[self.name], self.sensor, motion_of(run)) for run in self.recordings]
        return (
            np.concatenate([stream.time_s for stream in streams]),
            np.concatenate([stream.readings_rad_s for stream in streams]),
        )

    @property
    def samples(self) -> NDArray[Any]:
        """(n,) samples, SAMPLE_DTYPE: counts, board times and sequence numbers as the board sent them."""
        return np.concatenate([run.samples[self.name] for run in self.recordings])

    def to_dict(self) -> dict[str, Any]:
        """What is known of the sensor, as plain numbers and texts; not the samples."""
        return {"name": self.name, **asdict(self.sensor), "samples": len(self.samples)}

    def plot(self) -> "Plot":
        """The three axes over time, the sweeps shaded."""
        from rig.notebook.plots import plot_readings
        from rig.observation.windows import swept

        sweeps = [finished.window for run in self.recordings for finished in swept(run)]
        return plot_readings(*self.on_arm_clock(), sweeps, f"{self.name}, {self.sensor.mode} readings")

    def row(self) -> tuple[str, ...]:
        """The sensor in words, under `HEADINGS`."""
        sensor = self.sensor
        return self.name, sensor.part, sensor.serial_number, f"{sensor.rate_hz:g}", str(len(self.samples)), sensor.mode

    def __repr__(self) -> str:
        name, part, serial_number, rate_hz, samples, mode = self.row()
        return f"<{name}: {part} {serial_number}, {samples} samples at {rate_hz} Hz, {mode}>"

    def _repr_html_(self) -> str:
        return table(self.name, HEADINGS, [self.row()])


@dataclass(frozen=True, eq=False)
class Run(Mapping[str, Readings]):
    """A recorded run: `run["gyro"]` are a sensor's readings.

    `verification` is the movement with calibrated readings that followed, if one did.
    """

    recorded: RecordedRun

    @property
    def path(self) -> Path:
        """The run folder, or the run file."""
        return self.recorded.path

    @property
    def settings(self) -> RunSettings:
        """What the run is judged by."""
        return self.recorded.movement[0].settings

    @property
    def provenance(self) -> Provenance:
        """What was measured with what, and when."""
        return self.recorded.movement[0].provenance

    @property
    def verification(self) -> "Run | None":
        """The movement with calibrated readings, where it followed a calibration."""
        recorded = self.recorded
        if not (recorded.raw and recorded.corrected):
            return None
        return Run(RecordedRun(recorded.path, (), recorded.corrected, alone=True))

    @cached_property
    def calibration(self) -> Outcome | None:
        """What the raw readings amount to by themselves; None where none were recorded."""
        return judged(self.recorded.only_raw(), DEFAULT_ESTIMATOR) if self.recorded.raw else None

    @cached_property
    def corrected(self) -> tuple[ObservedRun, ...]:
        """The recordings of readings that the board had corrected."""
        return observe_runs(self.recorded.corrected) if self.recorded.corrected else ()

    def to_dict(self) -> dict[str, Any]:
        """What was recorded and what it is judged by, as plain numbers, lists and texts; not the samples."""
        sensors = {name: readings.to_dict() for name, readings in self.items()}
        return {"path": str(self.path), "settings": self.settings.document(), "sensors": sensors}

    @cached_property
    def _readings(self) -> Mapping[str, Readings]:
        recordings = self.recorded.movement
        return {name: Readings(name, sensor, recordings) for name, sensor in recordings[0].measuring(RATE).items()}

    def __getitem__(self, name: str) -> Readings:
        if name not in self._readings:
            known = ", ".join(self._readings)
            raise NoSuchSensor("no_such_sensor", f"{self.path} holds no sensor {name}", f"Choose one of: {known}")
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
    """A run folder, or a run file alone; nothing that lies beside the recordings is executed unless it is one's own.

    `script` names the script it was recorded by, where that is another's: it is executed. Raises Refused `no_run`, and
    as `read_run` and `load_script`.
    """
    return Run(open_run(Path(path), None if script is None else Path(script)))
