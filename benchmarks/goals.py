"""The benchmarks' goals, and the table of their results: `python benchmarks/goals.py BENCHMARK …`.

Runs the benchmarks one after the other and prints the table at the end. The exit status is 1 if a benchmark fails, and
3 if a figure misses its goal by more than a fifth.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

FIGURES = "RIG_BENCH_FIGURES"  # environment variable: the file of JSON lines that figures go to
BEHIND = 0.2
FAILED, FELL_BEHIND = 1, 3


@dataclass(frozen=True, slots=True)
class Goal:
    """A bound of a figure, or of its ratio to a peer's in the same run; the upper bound if `most`, else the lower."""

    bound: float
    compared: Literal["figure", "ratio"] = "figure"
    most: bool = True


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured value in a unit, and a peer's in the same unit, if there is one."""

    what: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """The value divided by the peer's."""
        return None if self.peer_value is None else self.value / self.peer_value


GOALS = {
    "rig solve RUN": Goal(0.85),
    "rig show RUN": Goal(0.4),
    "rig plan CONFIG": Goal(0.6),
    "rig check CONFIG": Goal(3.0),
    "rig --help": Goal(0.06),
    "end of a run, more than its solve": Goal(1.0),
    "vector model": Goal(0.7, "ratio"),
    "vector model with g-sensitivity": Goal(0.7, "ratio"),
    "solve of a recording, again": Goal(6.0, most=False),
    "batch, a run": Goal(1 / 500, "ratio"),
    "closed form, a run": Goal(1 / 20, "ratio"),
    "by hand, RMS error of scale": Goal(1 / 4, "ratio"),
    "decode to batches, three sensors": Goal(8.0, "ratio", most=False),
    "decode to batches, one at 952 Hz": Goal(8.0, "ratio", most=False),
    "decode a KVH 1775": Goal(40.0, most=False),
    "decode lines": Goal(5.0, "ratio", most=False),
    "operator's page, five browsers": Goal(2.0),
}


def record(what: str, value: float, unit: str, *, peer: str = "", peer_value: float | None = None) -> None:
    """Add a figure of `GOALS` to the table, if this benchmark is run for a table."""
    assert what in GOALS, f"{what} has no goal"
    if file := os.environ.get(FIGURES):
        figure = Figure(what, value, unit, peer, peer_value)
        with Path(file).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(asdict(figure)) + "\n")


def shortfall(figure: Figure, goal: Goal) -> float:
    """Return by which fraction of its goal a figure misses it; 0 or less if it is met."""
    value = figure.value if goal.compared == "figure" else figure.ratio
    assert value is not None, f"{figure.what} has no peer"
    return value / goal.bound - 1 if goal.most else goal.bound / value - 1


def table(figures: Iterable[Figure]) -> Iterator[str]:
    """Yield the lines of the table, in Markdown."""
    yield "| what | figure | peer | ratio | goal | met |"
    yield "| --- | ---: | ---: | ---: | ---: | --- |"
    for figure in figures:
        goal = GOALS[figure.what]
        peer = "" if figure.peer_value is None else f"{figure.peer} {figure.peer_value:.3g} {figure.unit}"
        ratio = "" if figure.ratio is None else f"{figure.ratio:.3g}"
        bound = (
            f"{'≤' if goal.most else '≥'} {goal.bound:.3g}{' times' if goal.compared == 'ratio' else f' {figure.unit}'}"
        )
        missed = shortfall(figure, goal)
        met = "yes" if missed <= 0 else f"no, by {missed:.0%}"
        yield f"| {figure.what} | {figure.value:.3g} {figure.unit} | {peer} | {ratio} | {bound} | {met} |"


def machine() -> str:
    """Return the name of this machine's processors, and their number."""
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    return f"{(names or [platform.processor() or platform.machine()])[0]}, {os.cpu_count()} processors"


def main(benchmarks: list[str]) -> int:
    """Run benchmarks, print their lines and the table."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figures"
        file.touch()
        environment = {**os.environ, FIGURES: str(file)}
        failed = [
            benchmark
            for benchmark in benchmarks
            if subprocess.run([sys.executable, benchmark], check=False, env=environment).returncode
        ]
        figures = [Figure(**json.loads(line)) for line in file.read_text("utf-8").splitlines()]
    print(f"\n{machine()}\n")
    print("\n".join(table(figures)))
    behind = [figure.what for figure in figures if shortfall(figure, GOALS[figure.what]) > BEHIND]
    if failed:
        print(f"failed: {', '.join(failed)}")
    if behind:
        print(f"behind their goal by more than {BEHIND:.0%}: {', '.join(behind)}")
    return FAILED if failed else FELL_BEHIND if behind else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
