"""Input and output of a study; nothing here computes, plots or writes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Columns = Mapping[str, Sequence[Any] | NDArray[Any]]


class StudyProgress(Protocol):
    """A function that passes on the results of a study's `total` tasks, and may show the progress."""

    def __call__(self, results: Iterable[Any], total: int) -> Iterable[Any]: ...


def pass_on(results: Iterable[Any], total: int) -> Iterable[Any]:
    """Return the results without showing progress."""
    return results


@dataclass(frozen=True, slots=True)
class Settings:
    """A study's settings: seed, `runs` per parameter set (None: the paper's or the study's own), distribution of work.

    `jobs` is joblib's `n_jobs`; None leaves it to the surrounding `joblib.parallel_config`, or else to one process.
    """

    seed: int = 1
    runs: int | None = None
    jobs: int | None = None
    progress: StudyProgress = pass_on


@dataclass(frozen=True, slots=True)
class StudyFinding:
    """One number of a study, and the published value, if any, both in `unit`."""

    quantity: str
    value: float
    unit: str
    published: float | None = None

    @property
    def ratio(self) -> float | None:
        """The ratio of the value to the published one; None if the latter is missing or zero."""
        return self.value / self.published if self.published else None


@dataclass(frozen=True, slots=True)
class StudyReport:
    """A study's results: `columns` of its table (unit in each name), findings, and the function that draws the plot."""

    columns: Columns
    findings: tuple[StudyFinding, ...]
    draw: Callable[["Figure"], None]
    size_inches: tuple[float, float] = (10.0, 6.0)


def table(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return a table, by column, from rows with equal keys."""
    listed = list(rows)
    return {name: [row[name] for row in listed] for name in listed[0]}
