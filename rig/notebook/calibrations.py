"""One sensor's calibration: its numbers ± U, and the correction of the user's readings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rig.data.entries.budget import expand_uncertainties
from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.notebook.html import table
from rig.notebook.own_readings import convert_own_readings
from rig.report.findings.finding import Finding
from rig.report.findings.result_kind import DisplayRow
from rig.report.kinds.triad import bias_of

HEADINGS = ("axis", "scale factor", "± U", "bias", "± U", "unit")
U_TEXT = "± U: contains the true value with a probability of about 95 % (k = 2 or Student's t)"
NOISE_TEXT = "± U: two standard deviations of the noise only"


@dataclass(frozen=True, eq=False)
class CharacteristicValue:
    """Numbers other than scale factors and biases, by `labels`: `values` and their U (`expanded`) in an SI `unit`."""

    labels: tuple[str, ...]
    values: Array
    expanded: Array
    unit: str


@dataclass(frozen=True, eq=False)
class Calibration:
    """Scale factors and biases of one sensor, with their uncertainties, and its `characteristics` by name.

    `apply` corrects a gyroscope's reading m to g = K (m + b), an accelerometer's or a magnetometer's to M (m − b).
    Arrays are in SI units: a bias in rad/s, m/s² or T. `entry` is the entry in `result.json`.
    """

    name: str
    finding: Finding[Any]
    shown: DisplayRow
    characteristics: Mapping[str, CharacteristicValue] = field(default_factory=dict)

    @property
    def entry(self) -> Any:
        """The calibration's entry in `result.json`."""
        return self.finding.entry

    @property
    def quantity(self) -> Quantity:
        """The measured quantity: its name, unit and axes."""
        return self.finding.quantity

    @property
    def scale(self) -> Array:
        """The scale factors (3,)."""
        return np.array(self.entry.scale)

    @property
    def bias(self) -> Array:
        """The bias (3,) in the SI unit of the quantity."""
        return np.array(bias_of(self.quantity, self.entry))

    @property
    def bias_rad_s(self) -> Array:
        """The biases (3,) of a gyroscope, rad/s."""
        return np.array(self.entry.bias_rad_s)

    @property
    def scale_expanded(self) -> Array:
        """The expanded uncertainties U (3,) of the scale factors, as on terminal and certificate."""
        return self._expanded[: len(self.entry.scale)]

    @property
    def bias_expanded(self) -> Array:
        """The expanded uncertainties U (3,) of the biases, in the unit of `bias`."""
        return self._expanded[len(self.entry.scale) :]

    @property
    def coverage_factors(self) -> Array:
        """The coverage factors k (6,) of U in the order kx ky kz bx by bz: U = k u."""
        budget = self.entry.budget
        return (
            np.array(budget.coverage_factors) if budget is not None else np.full(len(self._expanded), COVERAGE_FACTOR)
        )

    @property
    def covariance(self) -> Array:
        """Covariance (6, 6) of the solution alone, in the order kx ky kz bx by bz; U includes the complete budget."""
        return np.array(self.entry.covariance)

    @property
    def std(self) -> Array:
        """The standard deviations (6,) of `covariance`, which unlike U includes only noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    @property
    def correction_matrix(self) -> Array:
        """The matrix M (3, 3) of `apply` and `calibration.h`; diag(K) if the axes are not corrected."""
        matrix = getattr(self.entry, "correction_matrix", None)
        return np.diag(self.scale) if matrix is None else np.array(matrix)

    def apply(self, readings: ArrayLike) -> Array:
        """Return the corrected readings (n, 3) of this sensor, from readings (n, 3) in the SI unit of its quantity.

        For a gyroscope they are g = M (m + b), with M = K if only scale factors are corrected; for an accelerometer or
        a magnetometer, M (m − b). They are in the frame of `correction_matrix` in `result.json`, like those of
        `calibration.h`. A row with a NaN becomes NaN. Raise Refused `not_readings` for counts and other shapes,
        `wrong_unit` for numbers that are impossible in SI units, such as °/s, g or µT.
        """
        limit = getattr(self.entry, self.quantity.file_key("range"), None)
        valid = convert_own_readings(readings, self.quantity, limit, f"the {self.quantity.sensor} {self.name}")
        corrected: Array = (valid - self.quantity.offset * self.bias) @ self.correction_matrix.T
        return corrected

    def to_dict(self) -> dict[str, Any]:
        """Return the calibration's entry in `result.json`: plain numbers, lists and texts."""
        fields: dict[str, Any] = self.entry.model_dump(mode="json", exclude_unset=True)
        return fields

    @property
    def _expanded(self) -> Array:
        return np.array(expand_uncertainties(self.entry.budget, self.entry.covariance))

    def __repr__(self) -> str:
        scale, bias, unit = self.shown.scale, self.shown.numbers, self.shown.unit.name
        numbers = f"bias {_format_values(bias.values, '+.5f')} ± {max(bias.expanded):.2g} {unit}"
        if scale is not None:
            numbers = f"scale {_format_values(scale.values, '.5f')} ± {max(scale.expanded):.2g}, {numbers}"
        return f"<{self.name} by {self.entry.estimator}: {numbers} (U)>"

    def _repr_html_(self) -> str:
        title = f"{self.entry.part} {self.entry.serial_number}; {U_TEXT if self.shown.combined else NOISE_TEXT}"
        return table(title, HEADINGS, rows(self.shown))


def rows(shown: DisplayRow) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a table with `HEADINGS`, axis by axis, with U."""
    for i, label in enumerate(shown.labels[: len(shown.numbers.values)]):
        scale = ("–", "–")
        if shown.scale is not None:
            scale = f"{shown.scale.values[i]:.6f}", f"{shown.scale.expanded[i]:.6f}"
        number, width = f"{shown.numbers.values[i]:+.6f}", f"{shown.numbers.expanded[i]:.6f}"
        yield f"{shown.name} {label}".rstrip(), *scale, number, width, shown.unit.name


def _format_values(values: Any, form: str) -> str:
    return " ".join(f"{value:{form}}" for value in values)
