"""What all sensors of three axes share in a result: scale factors, biases and axes by one account of uncertainty."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from rich.table import Table

from rig.data.budget_entries import expanded_uncertainties
from rig.data.quantity import Quantity
from rig.data.result_file import ResultDocument
from rig.data.result_types import Freedom
from rig.report.axes import scale_and_bias_table
from rig.report.budget_table import budget_table, expanded_heading
from rig.report.kinds.followed import ANGLES, Calibrated, Followed, known, parameters, scale_and_bias
from rig.report.kinds.kind import Shown, Three


class Triad(Calibrated, Protocol):
    """A calibration from attitudes in `result.json`; its bias is of the name that its quantity makes."""

    @property
    def part(self) -> str: ...
    @property
    def serial_number(self) -> str: ...
    @property
    def estimator(self) -> str: ...
    @property
    def non_orthogonality_rad(self) -> Sequence[float]: ...
    @property
    def non_orthogonality_std_rad(self) -> Sequence[float]: ...
    @property
    def non_orthogonality_freedom(self) -> Sequence[Freedom] | None: ...


def bias_of(quantity: Quantity, entry: object) -> Sequence[float]:
    """The bias (3,) of an entry, in SI units."""
    found: Sequence[float] = getattr(entry, quantity.named("bias"))
    return found


def beside(sensor: str, quantity: Quantity) -> str:
    """How tables call the accelerometer or the magnetometer of that name."""
    return f"{sensor}, {quantity.sensor}"


def shown_of(name: str, quantity: Quantity, entry: Calibrated) -> Shown:
    """The row of page and notebook."""
    expanded, size = expanded_uncertainties(entry.budget, entry.covariance), quantity.bias.size
    bias = Three([each / size for each in bias_of(quantity, entry)], [each / size for each in expanded[3:]])
    return Shown(name, quantity.bias, bias, entry.budget is not None, Three(entry.scale, expanded[:3]))


def followed_of(
    sensor: str, quantity: Quantity, entry: Triad, document: ResultDocument, temperature_c: float | None
) -> Followed:
    """Scale, bias and axes as a history keeps them."""
    stds, freedom = entry.non_orthogonality_std_rad, entry.non_orthogonality_freedom
    followed = [
        *scale_and_bias(sensor, quantity, entry, bias_of(quantity, entry), document),
        *parameters(ANGLES, entry.non_orthogonality_rad, stds, freedom, "rad"),
    ]
    full_scale: float = getattr(entry, quantity.named("range"))
    return Followed(
        sensor,
        quantity.name,
        entry.part,
        entry.serial_number,
        full_scale,
        entry.estimator,
        temperature_c,
        known(followed),
    )


def tables(title: str, quantity: Quantity, entry: Calibrated) -> Iterator[Table]:
    """Scale and bias of each axis ± U, and what makes U up."""
    budget, expanded = entry.budget, expanded_uncertainties(entry.budget, entry.covariance)
    yield scale_and_bias_table(
        title, quantity, entry.scale, bias_of(quantity, entry), expanded, heading=expanded_heading(budget)
    )
    if budget is not None:
        yield budget_table(budget, entry.scale, quantity.bias)
