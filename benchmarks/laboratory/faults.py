"""All kinds of faults, at random moments: `python benchmarks/laboratory/faults.py [--moments 20] [--jobs 2]`.

Each fault of tests/support/fault_matrix/catalogue.py occurs in a run of each procedure at that many moments, in a
laboratory of its own. The results are compared with the promises of docs/reliability.md: a named end and its exit
status, the arm at rest within a second, no sample lost, a readable file, a run that resumes to its verdict, and no
passed run far from the truth.

Finished cells are kept in the folder given by --out and not repeated; --again repeats those that deviated. Prints the
table of docs/reliability.md; `deviations.json` lists the deviations. Moments depend on --seed alone.
"""

import argparse
import json
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from random import Random
from typing import Any
from zlib import crc32

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.fault_matrix.catalogue import BY_NAME
from support.fault_matrix.cell import Cell, carry_out, document, span
from support.fault_matrix.setups import SETUPS

ROOT = Path(__file__).parents[2]
Key = tuple[str, str, int]  # fault, procedure, number of the moment
KILLS = "process: kill -9: the rig or its driver"


def draw_moment(key: Key, seed: int) -> tuple[float, int]:
    """Return the time of the fault as a fraction of the procedure, and the seed of its random choices."""
    cell_seed = crc32(repr((seed, *key)).encode())
    return Random(cell_seed).uniform(0.02, 0.97), cell_seed


def read_earlier_cells(record: Path, *, again: bool) -> dict[Key, dict[str, Any]]:
    """Return the cells of earlier calls; with `again`, only those that did not deviate."""
    lines = record.read_text(encoding="utf-8").splitlines() if record.exists() else []
    cells = {(cell["fault"], cell["setup"], cell["number"]): cell for cell in map(json.loads, lines)}
    return {key: cell for key, cell in cells.items() if not (again and cell["deviations"])}


def run_cell(key: Key, seed: int, span_s: float, kept: Path) -> dict[str, Any]:
    """Run one cell; keep its folder if it deviates."""
    name, setup, number = key
    when, cell_seed = draw_moment(key, seed)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        cell_folder = Path(folder) / "cell"
        try:
            cell = carry_out(name, BY_NAME[name], setup, cell_folder, moment=when, span_s=span_s, seed=cell_seed)
        except Exception as error:  # of the bench itself: one cell must not end all the others
            cell = Cell(name, setup, when, deviations=[f"the bench failed: {type(error).__name__}: {error}"])
        if cell.deviations:
            shutil.copytree(cell_folder, kept / f"{crc32(repr(key).encode()):08x}", dirs_exist_ok=True)
    return {**document(cell), "number": number, "commit": commit()}


def table(cells: Iterable[dict[str, Any]]) -> Iterable[str]:
    """Yield the table's lines in Markdown, a row for each fault."""
    yield "| fault | runs | how they ended | arm at rest | not in the file | resumed to a pass | error | deviations |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    by_fault: dict[str, list[dict[str, Any]]] = {}
    for cell in cells:
        by_fault.setdefault(cell["fault"], []).append(cell)
    for name in sorted(by_fault, key=list(BY_NAME).index):
        met = [cell for cell in by_fault[name] if cell["met"]]
        endings = Counter(cell["ending"] for cell in met)
        rests = [cell["rest_s"] for cell in met if cell["rest_s"] is not None]
        resumed = [cell for cell in met if cell["resumes"]]
        ended = ", ".join(f"`{ending}` {count}" for ending, count in endings.most_common())
        yield " | ".join(
            [
                f"| {name}",
                str(len(met)),
                ended,
                f"{max(0.0, *rests, 0.0):.2f} s" if rests else "–",
                str(sum(cell["missing"] for cell in met)),
                f"{sum(cell['verdict'] == 'pass' for cell in resumed)} of {len(resumed)}",
                f"{max((cell['worst_u'] for cell in met), default=0.0):.1f} U",
                f"{sum(bool(cell['deviations']) for cell in met)} |",
            ]
        )


def main() -> int:
    """Try the chosen faults, record the outcome of each, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", nargs="+", metavar="TEXT", help="only those whose name holds one of these texts")
    parser.add_argument("--procedures", nargs="+", choices=SETUPS, default=list(SETUPS))
    parser.add_argument("--moments", type=int, default=1, metavar="N", help="of each fault in each procedure")
    parser.add_argument("--kills", type=int, metavar="N", help="moments of kill -9 of any process (default: --moments)")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="laboratories at a time")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "faults", metavar="DIR")
    parser.add_argument("--again", action="store_true", help="repeat what deviated")
    options = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGQUIT):  # a shell's background ignores them, and so would the runs
        signal.signal(number, signal.default_int_handler)
    options.out.mkdir(parents=True, exist_ok=True)
    record = options.out / "cells.jsonl"
    cells = read_earlier_cells(record, again=options.again)
    names = [name for name in BY_NAME if not options.faults or any(text in name for text in options.faults)]
    keys = [
        (name, setup, number)
        for number in range(max(options.moments, options.kills or 0))
        for name in names
        for setup in options.procedures
        if number < (options.kills if name == KILLS and options.kills is not None else options.moments)
    ]
    to_do = [key for key in keys if key not in cells]
    if to_do:
        spans = {setup: measure_undisturbed_s(setup) for setup in options.procedures}
        with ThreadPoolExecutor(options.jobs) as pool, record.open("a", encoding="utf-8") as lines:
            carried = pool.map(lambda key: run_cell(key, options.seed, spans[key[1]], options.out), to_do)
            for key, cell in zip(to_do, carried, strict=True):
                cells[key] = cell
                lines.write(json.dumps(cell) + "\n")
                lines.flush()
                report(cell)
    return conclude([cells[key] for key in keys], options.out)


def measure_undisturbed_s(setup: str) -> float:
    """Return the duration of the procedure in a run that passes without a fault."""
    with tempfile.TemporaryDirectory() as folder:
        cell, span_s = span(setup, Path(folder) / "cell")
    if cell.deviations:
        sys.exit(f"{setup}, undisturbed: {'; '.join(cell.deviations)}")
    return span_s


def report(cell: dict[str, Any]) -> None:
    """Print one line of progress."""
    deviations = "; ".join(cell["deviations"]) or "as promised"
    print(
        f"{cell['fault']}, {cell['setup']} at {cell['moment']:.2f}: {cell['ending'] or 'not met'}, {deviations} "
        f"({cell['wall_s']:.0f} s)",
        file=sys.stderr,
        flush=True,
    )


def conclude(cells: Sequence[dict[str, Any]], out: Path) -> int:
    """Print the table; return 1 if anything deviates, else 0."""
    deviating = [cell for cell in cells if cell["deviations"]]
    (out / "deviations.json").write_text(json.dumps(deviating, indent=2), encoding="utf-8")
    print("\n".join(table(cells)))
    met = sum(cell["met"] for cell in cells)
    faults = len({cell["fault"] for cell in cells})
    commits = ", ".join(sorted({cell["commit"] for cell in cells}))
    print(f"\n{met} runs met {faults} faults, at commit {commits}: {len(deviating)} deviate")
    return 1 if deviating else 0


@cache
def commit() -> str:
    """Return the measured commit as Git describes it, with `-dirty` if the files differ from it."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty"]
    return subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip() or "unknown"


if __name__ == "__main__":
    sys.exit(main())
