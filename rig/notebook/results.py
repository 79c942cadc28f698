"""A run's result: each sensor's calibration with its uncertainty, the checks, the verdict."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rig.analysis.calibration import DEFAULT_ESTIMATOR
from rig.analysis.check import Check
from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument
from rig.data.settings import setting
from rig.estimation.arrays import Array
from rig.notebook.html import table
from rig.notebook.runs import NoSuchSensor, Run
from rig.plans.recorded import judged
from rig.report.document import document_of
from rig.report.kinds.kind import Found, Shown, Without
from rig.report.kinds.registry import kinds, shown
from rig.report.kinds.triad import bias_of

if TYPE_CHECKING:
    from rig.notebook.plots import Plot


HEADINGS = ("axis", "scale factor", "± U (about 95 %)", "bias", "± U", "unit")


@dataclass(frozen=True, eq=False)
class Calibration:
    """Scale factors and biases of one sensor; of a gyroscope rate = `scale` × (reading + `bias`).

    `entry` is all that `result.json` has of it.
    """

    name: str
    found: Found[Any]
    shown: Shown

    @property
    def entry(self) -> Any:
        """What `result.json` says of it."""
        return self.found.entry

    @property
    def scale(self) -> Array:
        """(3,) scale factors."""
        return np.array(self.entry.scale)

    @property
    def bias(self) -> Array:
        """(3,) bias in the SI unit of what the sensor measures."""
        return np.array(bias_of(self.found.quantity, self.entry))

    @property
    def bias_rad_s(self) -> Array:
        """(3,) biases of a gyroscope."""
        return np.array(self.entry.bias_rad_s)

    @property
    def covariance(self) -> Array:
        """(6, 6) covariance in the order kx ky kz bx by bz."""
        return np.array(self.entry.covariance)

    @property
    def std(self) -> Array:
        """(6,) standard deviations, in the order of the covariance."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    def to_dict(self) -> dict[str, Any]:
        """What `result.json` says of it: plain numbers, lists and texts."""
        made: dict[str, Any] = self.entry.model_dump(mode="json", exclude_unset=True)
        return made

    def __repr__(self) -> str:
        scale, bias = (" ".join(f"{each:{form}}" for each in values) for values, form in self._forms())
        return f"<{self.name} by {self.entry.estimator}: scale {scale}, bias {bias} {self.shown.unit.name}>"

    def _forms(self) -> tuple[tuple[Sequence[float], str], tuple[Sequence[float], str]]:
        return (self.entry.scale, ".5f"), (self.shown.numbers.values, "+.5f")

    def _repr_html_(self) -> str:
        return table(f"{self.entry.part} {self.entry.serial_number}", HEADINGS, _rows(self.shown))


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Calibration]):
    """What a run amounts to: `result["gyro"]` is a sensor's calibration, `result["gyro, accelerometer"]` one beside it.

    Where a sensor has but one, its own name finds it.
    """

    outcome: Outcome

    @cached_property
    def document(self) -> ResultDocument:
        """The result as `result.json` has it."""
        return document_of(self.outcome)

    @cached_property
    def _calibrations(self) -> dict[str, Calibration]:
        found = (
            Calibration(shown.name, each, shown)
            for kind in kinds()
            if not isinstance(kind.shown, Without)
            for each in kind.found(self.document)
            if (shown := kind.shown(each)).scale is not None
        )
        return {each.name: each for each in found}

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """What the checks together say."""
        return self.outcome.verdict

    @property
    def checks(self) -> tuple[Check, ...]:
        """Every limit beside what was measured."""
        return self.outcome.checks

    def to_dict(self) -> dict[str, Any]:
        """The result as `result.json` has it: plain numbers, lists and texts."""
        return self.document.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def plot(self) -> "Plot":
        """What each sweep and rest leaves unexplained, sensor by sensor."""
        from rig.notebook.plots import plot_residuals

        return plot_residuals(self.outcome.results)

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
        calibrated = table(
            f"verdict: {self.verdict}", HEADINGS, [row for each in shown(self.document) for row in _rows(each)]
        )
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


def _rows(shown: Shown) -> Iterator[tuple[str, ...]]:
    """Axis by axis, with U, or with twice the standard deviations where no more is known."""
    for i, axis in enumerate("xyz"[: len(shown.numbers.values)]):
        scale = ("–", "–")
        if shown.scale is not None:
            scale = f"{shown.scale.values[i]:.6f}", f"{shown.scale.expanded[i]:.6f}"
        number, width = f"{shown.numbers.values[i]:+.6f}", f"{shown.numbers.expanded[i]:.6f}"
        yield f"{shown.name} {axis}", *scale, number, width, shown.unit.name


def _row(check: Check) -> tuple[str, ...]:
    value = "not measured" if check.value is None else f"{check.value:.4g}"
    limit = "not set" if check.limit is None else f"{check.limit:.4g}"
    return check.name, value, limit, check.unit, "ok" if check.passed else "FAILED"
