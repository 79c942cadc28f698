"""A run as it was recorded: its sensors' readings in rad/s on the arm's clock."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.data.provenance import Provenance
from rig.data.run_file import RecordedSensor
from rig.data.settings import RunSettings
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.notebook.html import table
from rig.plans.recorded import RecordedRun, open_run

if TYPE_CHECKING:
    from rig.notebook.plots import Plot


@dataclass(frozen=True)
class Readings:
    """One sensor's readings in all recordings of a movement, in the order they were made."""

    name: str
    sensor: RecordedSensor
    recorded: RecordedRun

    def on_arm_clock(self) -> tuple[Array, Array]:
        """Controller times (n,) in s and readings (n, 3) in rad/s. Raises Fault as `estimate_time_base` does."""
        return self._on_arm_clock

    @cached_property
    def _on_arm_clock(self) -> tuple[Array, Array]:
        from rig.observation.average import on_the_arms_clock
        from rig.observation.timebase import ArmMotion

        streams = [
            on_the_arms_clock(run.samples[self.name], self.sensor, ArmMotion(run.arm)) for run in self.recorded.movement
        ]
        return (
            np.concatenate([stream.time_s for stream in streams]),
            np.concatenate([stream.readings_rad_s for stream in streams]),
        )

    @property
    def samples(self) -> NDArray[Any]:
        """(n,) SAMPLE_DTYPE: counts, board times and sequence numbers as the board sent them."""
        return np.concatenate([run.samples[self.name] for run in self.recorded.movement])

    def plot(self) -> "Plot":
        """The three axes over time, the sweeps shaded."""
        from rig.notebook.plots import plot_readings

        return plot_readings(self)

    def __repr__(self) -> str:
        sensor = self.sensor
        return (
            f"<{self.name}: {sensor.part} {sensor.serial_number}, {len(self.samples)} samples at {sensor.rate_hz:g} Hz,"
            f" {sensor.mode}>"
        )


@dataclass(frozen=True)
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

    def __getitem__(self, name: str) -> Readings:
        sensors = self.recorded.movement[0].sensors
        if name not in sensors:
            raise Refused(
                "no_such_sensor", f"{self.path} holds no sensor {name}", f"Choose one of: {', '.join(sensors)}"
            )
        return Readings(name, sensors[name], self.recorded)

    def __iter__(self) -> Iterator[str]:
        return iter(self.recorded.movement[0].sensors)

    def __len__(self) -> int:
        return len(self.recorded.movement[0].sensors)

    def __repr__(self) -> str:
        return f"<run {self.path.name}: {self.settings.procedure}, {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        rows = [
            (name, r.sensor.part, r.sensor.serial_number, f"{r.sensor.rate_hz:g}", str(len(r.samples)), r.sensor.mode)
            for name, r in self.items()
        ]
        started = self.provenance.started_utc
        title = f"{self.path.name}: {self.settings.procedure}, {started}"
        return table(title, ("sensor", "part", "serial number", "Hz", "samples", "readings"), rows)


def load(path: str | Path) -> Run:
    """A run folder, or a run file alone. Raises Refused `no_run`, and as `read_run`."""
    return Run(open_run(Path(path)))
