"""A run's result: the sensors' calibrations with their uncertainties, the checks, the verdict."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rig.data.latest_run import meant_run
from rig.data.recording.settings import setting_path
from rig.data.result_file import CheckEntry, ResultDocument, read_result
from rig.notebook.calibrations import HEADINGS, U_TEXT, Calibration, CharacteristicValue, rows
from rig.notebook.frames import frame
from rig.notebook.html import table
from rig.notebook.readings import NoSuchSensor
from rig.notebook.runs import Run, load
from rig.plans.recorded_run import judge_phases
from rig.report.document import document_of
from rig.report.findings.finding import Finding
from rig.report.kinds.kind_registry import outlets, shown, terms_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from rig.notebook.reading_plots import Plot


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Calibration]):
    """A run's result, by calibration.

    `result["gyro"]` is a sensor's calibration, `result["gyro, accelerometer"]` another quantity's. If a sensor has only
    one quantity, its name is enough. `document` is the complete `result.json`.
    """

    document: ResultDocument

    @cached_property
    def _calibrations(self) -> dict[str, Calibration]:
        calibrations = (
            Calibration(shown.name, finding, shown, self._characteristics(finding))
            for _, show, finding in outlets(self.document, lambda kind: kind.shown)
            if (shown := show(finding)).scale is not None
        )
        return {calibration.name: calibration for calibration in calibrations}

    def _characteristics(self, finding: Finding[Any]) -> dict[str, CharacteristicValue]:
        """Return the characteristics of a sensor's quantity, in any kind of result."""
        key = finding.sensor, finding.quantity
        terms = (term for term in terms_of(self.document) if (term.finding.sensor, term.finding.quantity) == key)
        return {
            term.name: CharacteristicValue(
                tuple(term.characteristic.labels),
                np.array(term.numbers.values),
                np.array(term.expanded.widths),
                term.units.si,
            )
            for term in terms
        }

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """The verdict of all checks."""
        return self.document.verdict

    @property
    def checks(self) -> tuple[CheckEntry, ...]:
        """All checks with their limits."""
        return self.document.checks

    def to_dict(self) -> dict[str, Any]:
        """Return the result as in `result.json`: plain numbers, lists and texts."""
        return self.document.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def to_frame(self) -> "DataFrame":
        """Return a pandas table with one row for each axis of each calibration, in SI units.

        The index names sensor and axis; the columns are scale and bias, their expanded uncertainties and the unit of
        the bias. Raise Refused `missing_extra`.
        """
        rows = [(name, calibration, axis) for name, calibration in self.items() for axis in range(3)]
        columns = {
            "scale": [calibration.scale[axis] for _, calibration, axis in rows],
            "scale_expanded": [calibration.scale_expanded[axis] for _, calibration, axis in rows],
            "bias": [calibration.bias[axis] for _, calibration, axis in rows],
            "bias_expanded": [calibration.bias_expanded[axis] for _, calibration, axis in rows],
            "unit": [calibration.quantity.unit for _, calibration, _ in rows],
        }
        return frame(columns, [f"{name} {calibration.quantity.axes[axis]}" for name, calibration, axis in rows], "axis")

    def plot(self) -> "Plot":
        """Return a plot of the residuals of each sweep, rest, attitude and repeat, sensor by sensor.

        Raise Refused `nothing_to_plot`, `missing_extra`.
        """
        from rig.notebook.reading_plots import plot_residuals

        available = outlets(self.document, lambda kind: kind.unexplained)
        panels = ((f"{finding.sensor}, {kind.name}", residuals(finding)) for kind, residuals, finding in available)
        return plot_residuals([(name, unexplained) for name, unexplained in panels if unexplained is not None])

    def __getitem__(self, name: str) -> Calibration:
        by_name = self._calibrations
        of_sensor = [calibration for calibration in by_name.values() if calibration.finding.sensor == name]
        if name not in by_name and len(of_sensor) != 1:
            choices = (
                f"Choose one of: {', '.join(map(repr, by_name))}" if by_name else "Solve the recording of a calibration"
            )
            raise NoSuchSensor("no_such_sensor", f"this result has no calibration of {name}", choices)
        return by_name[name] if name in by_name else of_sensor[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._calibrations)

    def __len__(self) -> int:
        return len(self._calibrations)

    def __repr__(self) -> str:
        return f"<result: {self.verdict}, {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        values = [row for display_row in shown(self.document) for row in rows(display_row)]
        calibrated = table(f"verdict: {self.verdict}; {U_TEXT}", HEADINGS, values)
        checks = table("checks", ("check", "value", "limit", "unit", ""), map(_row, self.checks))
        return calibrated + checks


def solve(run: Run | str | Path, estimator: str | None = None, **changes: float) -> Result:
    """Solve and judge a run, as `rig solve` does, by `estimator` or by the procedure's own estimator.

    `run` is loaded if it is a path. `changes` are thresholds or limits to use instead of the recorded ones:
    `max_lost_fraction=0.01`. Raise Fault and Refused as `rig solve` and `load` do; Refused `unknown_setting` lists the
    possible changes.
    """
    run = run if isinstance(run, Run) else load(run)
    overrides = [f"{setting_path(key)}={value!r}" for key, value in changes.items()]
    return Result(document_of(judge_phases(run.recorded.override_settings(overrides), estimator)))


def load_result(path: str | Path) -> Result:
    """Load the `result.json` of a run folder, or at `path` itself, without solving again.

    `latest` is your last run. Raise Refused `no_result`, `not_a_result`, `no_latest_run`.
    """
    return Result(read_result(meant_run(path)))


def _row(check: CheckEntry) -> tuple[str, ...]:
    value = "not measured" if check.value is None else f"{check.value:.4g}"
    limit = "not set" if check.limit is None else f"{check.limit:.4g}"
    return check.name, value, limit, check.unit, "ok" if check.passed else "FAILED"
