"""A run's result: each sensor's calibration with its uncertainty, the checks, the verdict."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rig.data.recording.settings import setting
from rig.data.result_file import CheckEntry, ResultDocument, read_result
from rig.notebook.calibrations import HEADINGS, U_TEXT, Calibration, CharacteristicValue, rows
from rig.notebook.frames import frame
from rig.notebook.html import table
from rig.notebook.readings import NoSuchSensor
from rig.notebook.runs import Run
from rig.plans.recorded import judged
from rig.report.document import document_of
from rig.report.findings.finding import Finding
from rig.report.kinds.registry import outlets, shown, terms_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from rig.notebook.plots import Plot


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Calibration]):
    """What a run amounts to: `result["gyro"]` is a sensor's calibration, `result["gyro, accelerometer"]` one beside it.

    Where a sensor has but one, its own name finds it. `document` is the whole, as `result.json` has it.
    """

    document: ResultDocument

    @cached_property
    def _calibrations(self) -> dict[str, Calibration]:
        found = (
            Calibration(shown.name, finding, shown, self._beside(finding))
            for _, show, finding in outlets(self.document, lambda kind: kind.shown)
            if (shown := show(finding)).scale is not None
        )
        return {each.name: each for each in found}

    def _beside(self, of: Finding[Any]) -> dict[str, CharacteristicValue]:
        """What was found of a sensor's quantity beside its scale and bias, by whatever kind of result."""
        of_it = of.sensor, of.quantity
        found = (each for each in terms_of(self.document) if (each.finding.sensor, each.finding.quantity) == of_it)
        return {
            term.name: CharacteristicValue(
                tuple(term.characteristic.labels),
                np.array(term.known.values),
                np.array(term.expanded.widths),
                term.units.si,
            )
            for term in found
        }

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """What the checks together say."""
        return self.document.verdict

    @property
    def checks(self) -> tuple[CheckEntry, ...]:
        """Every limit beside what was measured."""
        return self.document.checks

    def to_dict(self) -> dict[str, Any]:
        """The result as `result.json` has it: plain numbers, lists and texts."""
        return self.document.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def to_frame(self) -> "DataFrame":
        """Return a pandas table with one row for each axis of each calibration, in SI units.

        The index names sensor and axis; the columns are scale and bias, their expanded uncertainties and the unit of
        the bias. Raise Refused `missing_extra`.
        """
        found = [(name, calibration, axis) for name, calibration in self.items() for axis in range(3)]
        columns = {
            "scale": [calibration.scale[axis] for _, calibration, axis in found],
            "scale_expanded": [calibration.scale_expanded[axis] for _, calibration, axis in found],
            "bias": [calibration.bias[axis] for _, calibration, axis in found],
            "bias_expanded": [calibration.bias_expanded[axis] for _, calibration, axis in found],
            "unit": [calibration.quantity.unit for _, calibration, _ in found],
        }
        return frame(
            columns, [f"{name} {calibration.quantity.axes[axis]}" for name, calibration, axis in found], "axis"
        )

    def plot(self) -> "Plot":
        """A plot of what models leave of each sweep, rest, attitude and repeat, sensor by sensor, and were expected to.

        Raises Refused `nothing_to_plot`, `missing_extra`.
        """
        from rig.notebook.plots import plot_residuals

        asked = outlets(self.document, lambda kind: kind.unexplained)
        found = ((f"{finding.sensor}, {kind.name}", leave(finding)) for kind, leave, finding in asked)
        return plot_residuals([(name, left) for name, left in found if left is not None])

    def __getitem__(self, name: str) -> Calibration:
        known = self._calibrations
        of_that_sensor = [each for each in known.values() if each.found.sensor == name]
        if name not in known and len(of_that_sensor) != 1:
            choices = f"Choose one of: {', '.join(known)}" if known else "Solve the recording of a calibration"
            raise NoSuchSensor("no_such_sensor", f"this result has no calibration of {name}", choices)
        return known[name] if name in known else of_that_sensor[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._calibrations)

    def __len__(self) -> int:
        return len(self._calibrations)

    def __repr__(self) -> str:
        return f"<result: {self.verdict}, {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        found = [row for each in shown(self.document) for row in rows(each)]
        calibrated = table(f"verdict: {self.verdict}; {U_TEXT}", HEADINGS, found)
        checks = table("checks", ("check", "value", "limit", "unit", ""), map(_row, self.checks))
        return calibrated + checks


def solve(run: Run, estimator: str | None = None, **changes: float) -> Result:
    """Solve and judge a run, as `rig solve` does, by its procedure's own estimator unless another is named.

    `changes` are thresholds or limits to judge it by instead of the recorded ones: `max_lost_fraction=0.01`. Raises
    Fault and Refused by name as `rig solve` does; `unknown_setting` says what can be changed.
    """
    overrides = [f"{setting(key)}={value!r}" for key, value in changes.items()]
    return Result(document_of(judged(run.recorded.judged_by(overrides), estimator)))


def load_result(path: str | Path) -> Result:
    """Load the `result.json` of a run folder, or at `path` itself: what was found then, without solving again.

    Raises Refused `no_result`, `not_a_result`.
    """
    return Result(read_result(Path(path)))


def _row(check: CheckEntry) -> tuple[str, ...]:
    value = "not measured" if check.value is None else f"{check.value:.4g}"
    limit = "not set" if check.limit is None else f"{check.limit:.4g}"
    return check.name, value, limit, check.unit, "ok" if check.passed else "FAILED"
