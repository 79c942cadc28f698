"""What a study is given and what it hands back; nothing here computes, plots or writes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Columns = Mapping[str, Sequence[Any] | NDArray[Any]]


class Progress(Protocol):
    """Hands on the results of a study's tasks as they come, and may show how many of `total` have come."""

    def __call__(self, results: Iterable[Any], total: int) -> Iterable[Any]: ...


def unseen(results: Iterable[Any], total: int) -> Iterable[Any]:
    """The progress that shows nothing."""
    return results


@dataclass(frozen=True, slots=True)
class Settings:
    """`runs` per parameter set (None: as many as the paper, or the study, has), the seed, and how the work is spread.

    `jobs` is joblib's `n_jobs`; None leaves it to the surrounding `joblib.parallel_config`, one process without any.
    """

    seed: int = 1
    runs: int | None = None
    jobs: int | None = None
    progress: Progress = unseen


@dataclass(frozen=True, slots=True)
class Finding:
    """One number a study was made for, beside the published one where there is one, both in `unit`."""

    quantity: str
    value: float
    unit: str
    published: float | None = None

    @property
    def ratio(self) -> float | None:
        """Ours over the published one; None where there is none, or where it is zero."""
        return self.value / self.published if self.published else None


@dataclass(frozen=True, slots=True)
class Report:
    """A study's results: `columns` of its table (unit in each name), findings, and how to draw the plot."""

    columns: Columns
    findings: tuple[Finding, ...]
    draw: Callable[["Figure"], None]
    size_inches: tuple[float, float] = (10.0, 6.0)


def table(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Rows of equal keys as columns."""
    listed = list(rows)
    return {name: [row[name] for row in listed] for name in listed[0]}
