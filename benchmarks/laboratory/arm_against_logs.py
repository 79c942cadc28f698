"""Compare the simulated arm's joints with logs of real ones: `python benchmarks/laboratory/arm_against_logs.py LOG...`.

A LOG is a CSV file: as the maker's RTDE recorder writes it (a heading, spaces between), or one without a heading from
`jointwise_motion` of github.com/shamilmamedov/dynamic_calibration (time, angles, rates, …), whose name ends with the
number of the joint that oscillates. Prints the same figures for each log and for the simulated arm, by the functions of
tests/support/motions/joint_figures.py, with which tests/world/ur10e/test_measured_joints.py tests the arm.
docs/simulated-arm.md lists the logs and the results.
"""

import argparse
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names

from support.motions.arm_states import LoggedArm
from support.motions.joint_figures import (
    Array,
    band_rms,
    following_lag_s,
    gentle_start,
    rest_noise,
    settling,
    smooth_sine,
    speed_ripple,
)

Log = dict[str, Array]
BANDS = {"95-106": range(95, 107), "110-135": range(110, 136), "194-212": range(194, 213), "390-415": range(390, 416)}
JOINTS = 6
REST_TICKS = 20  # at least, for a noise; the first ones after a move are left out
CRUISE_ROWS = 40
SWING_S, PERIOD_S = 50.0, 10.0  # of the oscillations in dynamic_calibration


def read_log(path: Path) -> Log:
    """Return the columns (n,) or (n, 6) of a log with a heading."""
    with path.open(encoding="utf-8") as file:
        names = file.readline().replace(",", " ").split()
        rows = np.loadtxt(file, delimiter="," if "," in file.readline() else None, ndmin=2)
    columns = dict(zip(names, rows.T, strict=False))
    complete = {name.rpartition("_")[0] for name in names if name.endswith("_5")}
    joints = {name: np.column_stack([columns[f"{name}_{joint}"] for joint in range(JOINTS)]) for name in complete}
    return {**columns, **joints}


def find_intervals(mask: NDArray[np.bool_]) -> Iterator[slice]:
    """Yield the intervals in which `mask` (n,) is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        yield slice(int(begin), int(end))


def describe(log: Log) -> Iterator[str]:
    """Yield lines about a log with targets."""
    time_s, speed = log["timestamp"], log["target_qd"]
    still = np.abs(speed).max(axis=1) < 1e-6
    for rest in find_intervals(still):
        rows = slice(rest.start + 6, rest.stop)
        if rest.stop - rows.start >= REST_TICKS:
            noises = [rest_noise(log["actual_q"][rows, joint]) for joint in range(JOINTS)]
            yield (
                f"rest of {time_s[rows][-1] - time_s[rows][0]:.2f} s: noise "
                f"{' '.join(f'{1e6 * noise.std_rad:.0f}' for noise in noises)} µrad, correlation "
                f"{' '.join(f'{noise.correlation:.2f}' for noise in noises)}, steps "
                f"{1e6 * min(noise.step_rad for noise in noises):.2f} µrad, rates up to "
                f"{1e3 * np.abs(log['actual_qd'][rows]).max():.2f} mrad/s"
            )
    if "speed_scaling" in log:
        yield f"speed scaling at rest: {np.unique(log['speed_scaling'][still])}"
    for joint in range(JOINTS):
        yield from (f"joint {joint + 1}: {line}" for line in describe_joint(log, joint))


def describe_joint(log: Log, joint: int) -> Iterator[str]:
    """Yield lines about one joint, if it moves: its lag, and the ripple, start and end of each of its moves."""
    names = "timestamp", "target_qd", "actual_q", "actual_qd", "target_q", "target_qdd"
    time_s, speed, q, qd, target, change = (log[n] if n == "timestamp" else log[n][:, joint] for n in names)
    moving = np.abs(speed) > 1e-3
    if not moving.any():
        return
    yield f"late by {1e3 * following_lag_s(q[moving], target[moving], speed[moving], change[moving]):.2f} ms"
    for move in find_intervals(np.abs(speed) > 1e-6):
        cruise = (np.abs(change[move]) < 1e-6) & (np.abs(speed[move]) > 0.05)
        if cruise.sum() > CRUISE_ROWS:
            ripple = speed_ripple(q[move][cruise], qd[move][cruise], speed[move][cruise])
            others = np.delete(log["actual_qd"][move][cruise], joint, axis=1).std(axis=0)
            alone = not np.delete(log["target_qd"][move][cruise], joint, axis=1).any()
            yield (
                f"at {np.abs(speed[move][cruise]).mean():.3f} rad/s ripple of {1e3 * ripple.rms_rad_s:.2f} mrad/s "
                f"({100 * ripple.fraction:.2f} %), strongest {ripple.peaks(4)}"
                + (f"; others {np.round(1e3 * others, 2)} mrad/s" if alone else "")
            )
        gentle = gentle_start(time_s[move], speed[move])
        if gentle is not None:
            yield f"starts gently: {1e3 * gentle.duration_s:.0f} ms, up to {gentle.overshoot:.2f} of the acceleration"
        after = slice(move.start, min(move.stop + round(0.2 / np.diff(time_s).mean()), len(time_s)))
        if move.stop + 8 < len(time_s) and not np.abs(speed[move.stop : after.stop]).any():
            end = settling(time_s[after], speed[after], qd[after], rest_rad_s=3e-3)
            yield (
                f"ends with {abs(change[move][-2]):.2f} rad/s²: back by {1e3 * end.back_rad_s:.1f} mrad/s, "
                f"below 3 mrad/s after {1e3 * end.duration_s:.0f} ms"
            )


def describe_swing(path: Path) -> Iterator[str]:
    """Yield lines about a log without targets, in which one joint oscillates."""
    number = re.search(r"joint_(\d)", path.stem)
    if number is None:
        raise SystemExit(f"{path}: the name of a log without a heading ends with the joint that swings: joint_1")
    joint = int(number[1]) - 1
    rows = np.loadtxt(path, delimiter=",")
    time_s, q, qd = rows[:, 0], rows[:, 1 + joint], rows[:, 7 + joint]
    end_s = time_s[np.flatnonzero(np.abs(qd) > 0.02)[-1]]
    within = (time_s > end_s - SWING_S) & (time_s < end_s - 1.0)
    time_s, q, qd = time_s[within], q[within], qd[within]
    residuals = qd - smooth_sine(time_s, qd, PERIOD_S)
    fast = np.abs(qd) > 0.35
    top = np.abs(qd) > 0.9 * np.abs(qd).max()
    sizes = {name: 1e3 * band_rms(q[fast], residuals[fast], orders) for name, orders in BANDS.items()}
    peaks = speed_ripple(q[fast], residuals[fast], np.zeros(int(fast.sum())) + 1e-9).peaks(4)
    yield (
        f"joint {joint + 1} swings up to {np.abs(qd).max():.2f} rad/s: ripple of {1e3 * residuals[fast].std():.2f} "
        f"mrad/s above 0.35 rad/s, {1e3 * residuals[top].std():.2f} at the top; by orders "
        f"{', '.join(f'{name}: {size:.1f}' for name, size in sizes.items())} mrad/s; strongest {peaks}; "
        f"below a tenth of the top {1e3 * residuals[np.abs(qd) < 0.1 * np.abs(qd).max()].std():.1f} mrad/s"
    )


def log_simulated_arm() -> Log:
    """Return a log of the simulated arm: a rest of 10 s, then a turn of each joint at 60 °/s."""
    arm = LoggedArm(["arm.home_deg=[-180, -180, -180, -180, -180, -180]"])
    arm.log(5000)
    for joint in range(JOINTS):
        q = list(arm.robot.motion.now.target_q_rad)
        q[joint] += 6.8
        arm.log_move(f"movej([{','.join(map(repr, q))}], a=1.0, v={math.radians(60)})")
    return arm.take()


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="*", type=Path)
    for path in parser.parse_args().log:
        with path.open(encoding="utf-8") as file:
            has_heading = "timestamp" in file.readline()
        print(f"\n{path.name}")
        for line in describe(read_log(path)) if has_heading else describe_swing(path):
            print(f"  {line}")
    print("\nsimulated")
    for line in describe(log_simulated_arm()):
        print(f"  {line}")


if __name__ == "__main__":
    main()
