"""One fault at one moment of one procedure: execution and judgement."""

import re
import time
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from firmware_host.answers import sample_batches
from firmware_host.frames import FrameReader
from firmware_host.protocol import SAMPLES
from rig.data.recording.run_file import read_run
from rig.data.run_folder import recordings
from rig.errors import RigError
from rig.observation.windows import dwelt, swept
from support.fault_matrix.bench import END_S, POLL_S, QUICK, REAL, START_S, Bench, alive, bench
from support.fault_matrix.catalogue import Fault
from support.fault_matrix.clock_shift import shift_clock
from support.fault_matrix.setups import SETUPS, errors_in_u

AT_REST_S = 1.0  # of the controller's time, after the fault can be known
WATCHED_S = 4.0  # wall time after a fault in which the laboratory goes at its real pace
WITHIN_U = 5.0
RESUMES = 3  # a verdict that names a sweep is resumed again
BEHIND_S = 0.1  # later data may still be on their way to the rig


@dataclass(slots=True)
class Cell:
    """The result of a cell. `deviations` is empty if all promises were kept."""

    fault: str
    setup: str
    moment: float  # of the procedure, 0 its beginning, 1 its end
    ending: str = ""  # the error's name, or the verdict
    status: int | None = None
    rest_s: float | None = None  # controller's time from the fault to the arm's last movement
    missing: int = 0  # samples received before the last one in the file, and until the fault, and not in the file
    resumes: int = 0
    verdict: str = ""
    worst_u: float = 0.0
    wall_s: float = 0.0
    met: bool = True  # whether the run was still going on
    deviations: list[str] = field(default_factory=list)


def carry_out(
    name: str,
    fault: Fault | None,
    setup: str,
    folder: Path,
    *,
    moment: float,
    span_s: float,
    seed: int,
) -> Cell:
    """Run `setup` in `folder`, with the fault (None: none) after the fraction `moment` of the usual `span_s`."""
    cell, random, began_s = Cell(name, setup, moment), Random(seed), time.monotonic()
    environment = shift_clock(folder.parent) if fault is not None and "CLOCK_SHIFT" in fault.environment else {}
    with bench(folder, SETUPS[setup], environment) as rig_bench:
        rig_bench.start()
        if not rig_bench.until(lambda state: state["program_running"], START_S):
            cell.deviations.append(f"did not start: {rig_bench.read_output('run')[-300:]}")
            return cell
        start_s = rig_bench.world.state()["time_s"]
        cell.met = fault is None or rig_bench.until(lambda state: state["time_s"] >= start_s + moment * span_s, START_S)
        if fault is not None and cell.met:
            _meet(rig_bench, fault, random, cell)
        else:
            rig_bench.ended(END_S)
            _account(rig_bench, None, cell, fault_s=0.0, fault_wall_s=0.0)
        if fault is not None and cell.met and cell.verdict != "pass":
            rig_bench.pace(QUICK)
            fault.mend(rig_bench, random)
            _resume(rig_bench, cell)
        if cell.verdict == "pass":
            cell.worst_u = errors_in_u(rig_bench.out)
            if not cell.worst_u <= WITHIN_U:
                cell.deviations.append(f"passed {cell.worst_u:.1f} U from the truth")
    cell.wall_s = time.monotonic() - began_s
    return cell


def _meet(rig_bench: Bench, fault: Fault, random: Random, cell: Cell) -> None:
    """Cause the fault in a running laboratory, and note every deviation from what must follow."""
    rig_bench.pace(REAL)
    fault_s, fault_wall_s = rig_bench.world.state()["time_s"], time.monotonic()
    driver_pid = rig_bench.driver_pid
    fault.bring(rig_bench, random)
    if fault.lasts_s is not None:
        time.sleep(fault.lasts_s)
        fault.mend(rig_bench, random)
    quick = False
    while rig_bench.running and time.monotonic() - fault_wall_s < END_S:
        if not quick and time.monotonic() - fault_wall_s > WATCHED_S + (fault.lasts_s or 0.0):
            rig_bench.pace(QUICK)
            quick = True
        time.sleep(POLL_S)
    if rig_bench.running:
        cell.deviations.append("hung")
        rig_bench.end()
    if not rig_bench.until(_stands, 30, running=False):
        cell.deviations.append("the arm still moves")
    _account(rig_bench, fault, cell, fault_s=fault_s, fault_wall_s=fault_wall_s)
    for _ in range(100):
        if driver_pid is None or not alive(driver_pid) or "driver frozen" in cell.fault:
            break
        time.sleep(0.1)
    else:
        cell.deviations.append("left its driver behind")
    _companions(rig_bench, cell)


def _stands(state: dict[str, Any]) -> bool:
    return not state["moving"] and bool(state["time_s"] > state["still_since_s"])


def _companions(rig_bench: Bench, cell: Cell) -> None:
    for second in rig_bench.companions:
        _, output = second.communicate(timeout=END_S)
        if second.returncode != 2 or not re.search(r"^rig: \w+: ", output, re.MULTILINE):
            cell.deviations.append(f"the second rig ended with {second.returncode}: {output[-200:]}")


def _account(rig_bench: Bench, fault: Fault | None, cell: Cell, *, fault_s: float, fault_wall_s: float) -> None:
    """Record the end of the run, the time of the arm's rest, and whether the file has all that was received."""
    assert rig_bench.process is not None
    output = rig_bench.read_output("run")
    cell.status = rig_bench.process.poll()
    cell.ending = _ending(cell.status, output)
    if cell.status == 0:
        cell.verdict = "pass"
    if "Traceback" in output:
        cell.deviations.append(f"traceback: {output[-400:]}")
    if fault is None:
        if cell.status != 0:
            cell.deviations.append(f"undisturbed, and ended with {cell.status}: {output[-300:]}")
        return
    passed = cell.status == 0 and (fault.may_pass or (fault.late_may_pass and _came_late(rig_bench, fault_s)))
    named = cell.status in fault.statuses and (not fault.names or cell.status != 3 or cell.ending in fault.names)
    if not (passed or named):
        cell.deviations.append(f"ended with {cell.status} {cell.ending}: {output[-300:]}")
    if cell.status != 0:
        cell.rest_s = rig_bench.world.state()["still_since_s"] - fault_s
        if fault.known_s is not None and cell.rest_s > fault.known_s + AT_REST_S:
            cell.deviations.append(f"at rest only {cell.rest_s:.2f} s after the fault")
    _files(rig_bench, fault, cell, fault_wall_s)


def _came_late(rig_bench: Bench, fault_s: float) -> bool:
    """Return whether all data for a calibration were already recorded."""
    run = read_run(recordings(rig_bench.out, "raw")[0])
    windows = [sweep.window for sweep in swept(run)] + [dwell.window for dwell in dwelt(run)]
    return all(window.end_s <= fault_s for window in windows)


def _ending(status: int | None, output: str) -> str:
    errors = re.findall(r"^rig: (\w+): ", output, re.MULTILINE)
    named = {0: "pass", 1: "fail", 130: "interrupted", -9: "killed", None: "hung"}
    return named.get(status) or (errors[-1] if errors else "no name")


def _files(rig_bench: Bench, fault: Fault, cell: Cell, fault_wall_s: float) -> None:
    try:
        runs = [read_run(path) for path in recordings(rig_bench.out, "raw")]
    except RigError as error:
        cell.deviations.append(f"the file is not readable: {error}")
        return
    if not runs:
        cell.deviations.append("there is no file")
        return
    recorded = runs[0].samples["gyro"]
    if not len(recorded):
        return  # nothing had been received, or the arm had not begun
    to_s = max(fault_wall_s - max(fault.kept_s, BEHIND_S), recorded["host_time_s"].max() - BEHIND_S)
    delivered = _find_delivered(rig_bench, recorded["host_time_s"][0], to_s)
    cell.missing = len(delivered - set(recorded["board_time_us"].tolist()))
    if cell.missing:
        cell.deviations.append(f"{cell.missing} of {len(delivered)} samples received are not in the file")


def _find_delivered(rig_bench: Bench, from_s: float, to_s: float) -> set[int]:
    """Return the board's time stamps of the samples that the rig received between two wall times, s."""
    reader, stamps = FrameReader(), set[int]()
    for wall_s, data in rig_bench.wire["board"].delivered or []:
        for frame in reader.feed(data):
            if frame.name in SAMPLES and from_s + BEHIND_S < wall_s < to_s:
                stamps.update(*(batch.samples["board_time_us"].tolist() for batch in sample_batches([frame], wall_s)))
    return stamps


def _resume(rig_bench: Bench, cell: Cell) -> None:
    status: int | None = None
    while status != 0 and cell.resumes < RESUMES:
        cell.resumes += 1
        rig_bench.process = rig_bench.rig("resume", str(rig_bench.out), "--yes")
        if not rig_bench.ended(END_S):
            cell.deviations.append("resuming hung")
            return
        status = rig_bench.process.poll()
        if status not in (0, 1):
            break
    finished = cell.status == 1 and "already_finished" in rig_bench.read_output(
        "resume"
    )  # the verdict it had is the one it has
    cell.verdict = "fail" if finished else {0: "pass", 1: "fail"}.get(-1 if status is None else status, "none")
    if status != 0 and not finished:
        cell.deviations.append(f"resumed, it ended with {status}: {rig_bench.read_output('resume')[-400:]}")


def span(setup: str, folder: Path) -> tuple[Cell, float]:
    """Run a setup without a fault; return its result, and the arm's duration by the controller's clock, s."""
    cell = carry_out("none", None, setup, folder, moment=1.0, span_s=0.0, seed=0)
    arm = read_run(folder / "run" / "run.h5").states
    moving = np.flatnonzero(np.abs(arm["qd_rad_s"]).max(axis=1) > 0)
    return cell, float(arm["time_s"][moving[-1]] - arm["time_s"][moving[0]])


def document(cell: Cell) -> dict[str, Any]:
    """Return a cell as a JSON document."""
    return {name: getattr(cell, name) for name in cell.__slots__}
