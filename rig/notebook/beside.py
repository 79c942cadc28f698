"""Two sensors of one run beside each other, before and after calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.alignment import RelativeRotation
from rig.analysis.comparison import Comparison, Reference
from rig.analysis.comparison import compare as compare_readings
from rig.analysis.verification import relative_mounting
from rig.errors import Refused
from rig.notebook.html import table
from rig.notebook.results import Result, solve
from rig.notebook.runs import Run
from rig.observation.observed_run import ObservedRun, observe_runs

if TYPE_CHECKING:
    from rig.notebook.plots import Plot


@dataclass(frozen=True)
class Beside:
    """Readings of `sensor` beside those of `reference`, in the frame of `sensor`.

    `before` are its raw readings, `after` those that the board had corrected; None where they were not recorded.
    """

    sensor: str
    reference: str
    rotation: RelativeRotation
    before: Comparison | None
    after: Comparison | None

    @property
    def shown(self) -> Comparison:
        """What is plotted: calibrated readings where there are any."""
        found = self.after or self.before
        assert found is not None  # compare() makes none without either
        return found

    def plot(self) -> "Plot":
        """Both over time, and their difference."""
        from rig.notebook.plots import plot_comparison

        return plot_comparison(self.shown, self.sensor, self.reference)

    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (when, *(f"{rms:.5f}" for rms in found.movement.rms_rad_s))
            for when, found in (("before", self.before), ("after", self.after))
            if found is not None
        ]

    def __repr__(self) -> str:
        rms = "; ".join(f"{when} {' '.join(values)}" for when, *values in self._rows())
        return f"<{self.sensor} beside {self.reference}: RMS {rms} rad/s>"

    def _repr_html_(self) -> str:
        return table(f"{self.sensor} beside {self.reference}, RMS rad/s", ("calibration", "x", "y", "z"), self._rows())


def compare(run: Run, sensor: str, reference: str) -> Beside:
    """Compare two sensors of a run sample by sample, the one corrected by what is known of it.

    The reference's calibration is the turntable's where the run names one, else this run's own. Raises Refused
    `no_such_sensor`; Fault as `rig.analysis.comparison.compare` does.
    """
    for name in (sensor, reference):
        run[name]  # refused by name
    recorded = run.recorded
    result = solve(Run(recorded.only_raw())) if recorded.raw else None
    before, after = (observe_runs(runs) if runs else () for runs in (recorded.raw, recorded.corrected))
    raw = before or after
    known = _known(run, reference, result, raw)
    calibration = result.outcome.results[sensor] if result is not None else None
    rotation = relative_mounting(sensor, known, raw, calibration)
    parts = (
        compare_readings(part, sensor, _known(run, reference, result, part), rotation.matrix) if part else None
        for part in (before, after)
    )
    return Beside(sensor, reference, rotation, *parts)


def _known(run: Run, name: str, result: Result | None, recordings: Sequence[ObservedRun]) -> Reference:
    """What corrects a sensor's readings in these recordings: nothing where the board has done it already."""
    if recordings[0].run.sensors[name].mode == "calibrated":
        return Reference(name, np.ones(3), np.zeros(3))
    turntable = run.settings.reference
    if turntable is not None and turntable.name == name:
        return Reference(name, np.array(turntable.scale), np.array(turntable.bias_rad_s))
    if result is None:
        raise Refused(
            "nothing_to_compare",
            f"{run.path} tells nothing of {name}'s own calibration",
            "Compare with the sensor whose role is reference",
        )
    found = result[name]
    return Reference(name, found.scale, found.bias_rad_s)
