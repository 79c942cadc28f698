"""Two sensors of one run in comparison, before and after calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.gyroscope.alignment import RelativeRotation
from rig.analysis.gyroscope.comparison import Comparison, Reference
from rig.analysis.gyroscope.comparison import compare as compare_readings
from rig.analysis.gyroscope.verification import fit_mounting
from rig.data.quantity import RATE
from rig.errors import Refused
from rig.notebook.html import table
from rig.notebook.runs import Run
from rig.observation.observed_run import ObservedRun

if TYPE_CHECKING:
    from rig.notebook.reading_plots import Plot


@dataclass(frozen=True, eq=False)
class SensorComparison:
    """Readings of `sensor` compared with those of `reference`, in the frame of `sensor`.

    `before` has its raw readings, `after` those corrected by the board; None if they were not recorded.
    """

    sensor: str
    reference: str
    rotation: RelativeRotation
    before: Comparison | None
    after: Comparison | None

    @property
    def shown(self) -> Comparison:
        """The plotted comparison: that of calibrated readings, if recorded."""
        return next(part for part in (self.after, self.before) if part is not None)

    def plot(self) -> "Plot":
        """Return a plot of sensor and reference over time, and of their difference."""
        from rig.notebook.reading_plots import plot_comparison

        return plot_comparison(self.shown, self.sensor, self.reference)

    def to_dict(self) -> dict[str, Any]:
        """Return the RMS of the difference on each axis, rad/s, and the relative rotation, as plain numbers."""
        parts = {"before": self.before, "after": self.after}
        return {
            "sensor": self.sensor,
            "reference": self.reference,
            "rotation_rad": self.rotation.vector_rad.tolist(),
            "rms_rad_s": {when: part.movement.rms_rad_s.tolist() for when, part in parts.items() if part is not None},
        }

    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (when, *(f"{rms:.5f}" for rms in comparison.movement.rms_rad_s))
            for when, comparison in (("before", self.before), ("after", self.after))
            if comparison is not None
        ]

    def __repr__(self) -> str:
        rms = "; ".join(f"{when} {' '.join(values)}" for when, *values in self._rows())
        return f"<{self.sensor} against {self.reference}: RMS {rms} rad/s>"

    def _repr_html_(self) -> str:
        return table(f"{self.sensor} against {self.reference}, RMS rad/s", ("calibration", "x", "y", "z"), self._rows())


def compare(run: Run, sensor: str, reference: str) -> SensorComparison:
    """Compare two sensors of a run sample by sample; the reference's readings are corrected.

    The reference's calibration is the turntable's if the run states one, otherwise this run's. Raise Refused
    `no_such_sensor`, `nothing_to_compare`; Fault as `rig.analysis.gyroscope.comparison.compare` does.
    """
    for name in (sensor, reference):
        if RATE.name not in run[name].quantities:
            raise Refused(
                "nothing_to_compare", f"the sensor {name} measures no rates", "Give the names of two gyroscopes"
            )
    calibration = run.calibration
    before = calibration.recordings if calibration is not None else ()
    raw = before or run.corrected
    standard = _correction_of(run, reference, raw)
    rotation = fit_mounting(sensor, standard, raw, calibration.results[sensor] if calibration is not None else None)
    parts = (
        compare_readings(part, sensor, _correction_of(run, reference, part), rotation.matrix) if part else None
        for part in (before, run.corrected)
    )
    return SensorComparison(sensor, reference, rotation, *parts)


def _correction_of(run: Run, name: str, recordings: Sequence[ObservedRun]) -> Reference:
    """Return the calibration that corrects a sensor: the turntable's, the run's, or none for corrected readings.

    Raise Refused `nothing_to_compare` if the run has no calibration.
    """
    if recordings[0].run.sensors[name].mode == "calibrated":
        return Reference(name, np.ones(3), np.zeros(3))
    turntable = run.settings.reference
    if turntable is not None and turntable.name == name:
        return Reference(name, np.array(turntable.scale), np.array(turntable.bias_rad_s))
    if run.calibration is None:
        raise Refused(
            "nothing_to_compare",
            f"{run.path} does not contain {name}'s own calibration",
            "Compare with the sensor whose role is reference",
        )
    result = run.calibration.results[name]
    return Reference(name, result.scale, result.bias_rad_s)
