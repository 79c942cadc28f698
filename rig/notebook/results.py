"""A run's result: each sensor's calibration with its uncertainty, the checks, the verdict."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rig.analysis.calibration import DEFAULT_ESTIMATOR, SensorResult
from rig.analysis.outcome import Outcome
from rig.analysis.verdict import Check
from rig.data.settings import setting
from rig.estimation.arrays import Array
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.notebook.html import table
from rig.notebook.runs import NoSuchSensor, Run
from rig.plans.recorded import judged

if TYPE_CHECKING:
    from rig.notebook.plots import Plot


@dataclass(frozen=True, eq=False)
class Calibration:
    """One sensor's calibration: rate = `scale` × (reading + `bias_rad_s`)."""

    name: str
    found: SensorResult

    @property
    def scale(self) -> Array:
        """(3,)"""
        return self.found.scale

    @property
    def bias_rad_s(self) -> Array:
        """(3,)"""
        return self.found.bias_rad_s

    @property
    def covariance(self) -> Array:
        """(6, 6) in the order kx ky kz bx by bz."""
        return self.found.solution.covariance

    @property
    def std(self) -> Array:
        """(6,) standard deviations, in the order of the covariance."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    def to_dict(self) -> dict[str, Any]:
        """Scale, bias and covariance as `result.json` has them."""
        from rig.report.sensor_entry import estimate_entry

        return estimate_entry(self.found.solution).model_dump(mode="json")

    def rows(self) -> list[tuple[str, ...]]:
        """Axis, scale factor and bias with U, or with twice their standard deviations where no more is known."""
        budget = self.found.uncertainty
        expanded = COVERAGE_FACTOR * self.std if budget is None else budget.expanded
        return [
            (
                f"{self.name} {axis}",
                f"{self.scale[i]:.6f}",
                f"{expanded[i]:.6f}",
                f"{self.bias_rad_s[i]:+.6f}",
                f"{expanded[3 + i]:.6f}",
            )
            for i, axis in enumerate("xyz")
        ]

    def __repr__(self) -> str:
        scale, bias = (" ".join(f"{value:{form}}" for value in each) for each, form in self._forms())
        return f"<{self.name} by {self.found.solution.estimator}: scale {scale}, bias {bias} rad/s>"

    def _forms(self) -> tuple[tuple[Array, str], tuple[Array, str]]:
        return (self.scale, ".5f"), (self.bias_rad_s, "+.5f")

    def _repr_html_(self) -> str:
        return table(f"{self.found.sensor.part} {self.found.serial_number}", HEADINGS, self.rows())


HEADINGS = ("axis", "scale factor", "± U (about 95 %)", "bias rad/s", "± U rad/s")


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Calibration]):
    """What a run amounts to: `result["gyro"]` is a sensor's calibration."""

    outcome: Outcome

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """What the checks together say."""
        return self.outcome.verdict

    @property
    def checks(self) -> tuple[Check, ...]:
        """Every limit beside what was measured."""
        return self.outcome.checks

    def to_dict(self) -> dict[str, Any]:
        """As `result.json` has it: plain numbers, lists and texts."""
        from rig.report.document import document_of

        return document_of(self.outcome).model_dump(mode="json", by_alias=True, exclude_unset=True)

    def plot(self) -> "Plot":
        """What each sweep and rest leaves unexplained, sensor by sensor."""
        from rig.notebook.plots import plot_residuals

        return plot_residuals(self.outcome.results)

    def __getitem__(self, name: str) -> Calibration:
        results = self.outcome.results
        if name not in results:
            known = f"Choose one of: {', '.join(results)}" if results else "Solve the recording of a calibration"
            raise NoSuchSensor("no_such_sensor", f"this result has no calibration of {name}", known)
        return Calibration(name, results[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self.outcome.results)

    def __len__(self) -> int:
        return len(self.outcome.results)

    def __repr__(self) -> str:
        return f"<result: {self.verdict}, {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        calibrated = table(f"verdict: {self.verdict}", HEADINGS, [row for each in self.values() for row in each.rows()])
        checks = table("checks", ("check", "value", "limit", "unit", ""), map(_row, self.checks))
        return calibrated + checks


def solve(run: Run, estimator: str = DEFAULT_ESTIMATOR, **changes: float) -> Result:
    """Solve and judge a run, as `rig solve` does.

    `changes` are thresholds or limits to judge it by instead of the recorded ones: `max_lost_fraction=0.01`. Raises
    Fault and Refused by name as `rig solve` does; `unknown_setting` says what can be changed.
    """
    return Result(
        judged(run.recorded.judged_by([f"{setting(key)}={value!r}" for key, value in changes.items()]), estimator)
    )


def _row(check: Check) -> tuple[str, ...]:
    value = "not measured" if check.value is None else f"{check.value:.4g}"
    limit = "not set" if check.limit is None else f"{check.limit:.4g}"
    return check.name, value, limit, check.unit, "ok" if check.passed else "FAILED"
