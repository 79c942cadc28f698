"""One sensor's calibration: its numbers ± U, and what it makes of readings of one's own."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rig.data.entries.budget import expanded_uncertainties
from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.notebook.html import table
from rig.notebook.own_readings import own_readings
from rig.report.findings.finding import Finding
from rig.report.findings.kind import Shown
from rig.report.kinds.triad import bias_of

HEADINGS = ("axis", "scale factor", "± U", "bias", "± U", "unit")
U_TEXT = "± U: about 95 % of true values lie within (k = 2 or Student's t)"
NOISE_TEXT = "± U: two standard deviations of noise; no more is known"


@dataclass(frozen=True, eq=False)
class CharacteristicValue:
    """Numbers found beside scale factors and biases, by their `labels`: `values` and `expanded`, U, in an SI `unit`."""

    labels: tuple[str, ...]
    values: Array
    expanded: Array
    unit: str


@dataclass(frozen=True, eq=False)
class Calibration:
    """Scale factors and biases of one sensor, with their uncertainties, and their `characteristics`, by name.

    A gyroscope's reading m is corrected as g = K (m + b), an accelerometer's or a magnetometer's as M (m − b); `apply`
    does it. Arrays are in SI units: a bias in rad/s, m/s² or T. `entry` is all that `result.json` has of it.
    """

    name: str
    found: Finding[Any]
    shown: Shown
    characteristics: Mapping[str, CharacteristicValue] = field(default_factory=dict)

    @property
    def entry(self) -> Any:
        """What `result.json` says of the calibration."""
        return self.found.entry

    @property
    def quantity(self) -> Quantity:
        """What the sensor measures: its name, unit and axes."""
        return self.found.quantity

    @property
    def scale(self) -> Array:
        """(3,) scale factors."""
        return np.array(self.entry.scale)

    @property
    def bias(self) -> Array:
        """(3,) bias in the SI unit of what the sensor measures."""
        return np.array(bias_of(self.quantity, self.entry))

    @property
    def bias_rad_s(self) -> Array:
        """(3,) biases of a gyroscope."""
        return np.array(self.entry.bias_rad_s)

    @property
    def scale_expanded(self) -> Array:
        """(3,) expanded uncertainties U of the scale factors, as terminal and certificate state them."""
        return self._expanded[: len(self.entry.scale)]

    @property
    def bias_expanded(self) -> Array:
        """(3,) expanded uncertainties U of the biases, in the unit of `bias`."""
        return self._expanded[len(self.entry.scale) :]

    @property
    def coverage_factors(self) -> Array:
        """(6,) coverage factors k of U in the order kx ky kz bx by bz: U = k u."""
        budget = self.entry.budget
        return (
            np.array(budget.coverage_factors) if budget is not None else np.full(len(self._expanded), COVERAGE_FACTOR)
        )

    @property
    def covariance(self) -> Array:
        """(6, 6) covariance by the solution alone, in the order kx ky kz bx by bz; U holds the whole budget instead."""
        return np.array(self.entry.covariance)

    @property
    def std(self) -> Array:
        """(6,) standard deviations of that covariance: one, and of noise alone. What ± says is U."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    @property
    def correction_matrix(self) -> Array:
        """(3, 3) matrix M by which `apply` and `calibration.h` correct; diag(K) where the axes are not corrected."""
        whole = getattr(self.entry, "correction_matrix", None)
        return np.diag(self.scale) if whole is None else np.array(whole)

    def apply(self, readings: ArrayLike) -> Array:
        """Correct readings (n, 3) of this sensor, in the SI unit of what it measures; returns (n, 3) in that unit.

        A gyroscope's are g = M (m + b), M = K where only scale factors are corrected; an accelerometer's and a
        magnetometer's M (m − b). They come out in the frame that `result.json` says of its `correction_matrix`, as by
        the functions of `calibration.h`. A row with a NaN becomes NaN. Raises Refused `not_readings` for counts and for
        another shape, `wrong_unit` for numbers that this sensor cannot read in its SI unit, such as °/s, g or µT.
        """
        limit = getattr(self.entry, self.quantity.named("range"), None)
        found = own_readings(readings, self.quantity, limit, f"the {self.quantity.sensor} {self.name}")
        corrected: Array = (found - self.quantity.offset * self.bias) @ self.correction_matrix.T
        return corrected

    def to_dict(self) -> dict[str, Any]:
        """What `result.json` says of the calibration: plain numbers, lists and texts."""
        made: dict[str, Any] = self.entry.model_dump(mode="json", exclude_unset=True)
        return made

    @property
    def _expanded(self) -> Array:
        return np.array(expanded_uncertainties(self.entry.budget, self.entry.covariance))

    def __repr__(self) -> str:
        scale, bias, unit = self.shown.scale, self.shown.numbers, self.shown.unit.name
        told = f"bias {_few(bias.values, '+.5f')} ± {max(bias.expanded):.2g} {unit}"
        if scale is not None:
            told = f"scale {_few(scale.values, '.5f')} ± {max(scale.expanded):.2g}, {told}"
        return f"<{self.name} by {self.entry.estimator}: {told} (U)>"

    def _repr_html_(self) -> str:
        title = f"{self.entry.part} {self.entry.serial_number}; {U_TEXT if self.shown.combined else NOISE_TEXT}"
        return table(title, HEADINGS, rows(self.shown))


def rows(shown: Shown) -> Iterator[tuple[str, ...]]:
    """The rows of a table under `HEADINGS`, axis by axis with U."""
    for i, label in enumerate(shown.labels[: len(shown.numbers.values)]):
        scale = ("–", "–")
        if shown.scale is not None:
            scale = f"{shown.scale.values[i]:.6f}", f"{shown.scale.expanded[i]:.6f}"
        number, width = f"{shown.numbers.values[i]:+.6f}", f"{shown.numbers.expanded[i]:.6f}"
        yield f"{shown.name} {label}".rstrip(), *scale, number, width, shown.unit.name


def _few(values: Any, form: str) -> str:
    return " ".join(f"{each:{form}}" for each in values)
