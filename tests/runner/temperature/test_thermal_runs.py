"""Calibrations over temperature, whole: a heater or an operator warms, and what is not as it should be ends by name."""

import signal
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.data.quantity import TEMPERATURE
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.data.recording.thermal_events import SetMeasured, TemperatureWanted
from rig.data.result_file import read_result
from rig.observation.finished_steps import complete_sweeps
from support.laboratories.commands import configuration, rig, rig_here, wait_for_log
from support.laboratories.worlds import World, hardware, merge, world
from support.processes.waiting import PATIENCE_S, alive, wait_for
from support.processes.warm import start_module

__all__ = ["world"]

pytestmark = pytest.mark.slow

PROCEDURE: dict[str, Any] = {
    "name": "thermal",
    "from_c": 25,
    "to_c": 40,
    "max_step_k": 5,
    "max_rate_k_per_min": 30,
    "reference_c": 30,
    "both_directions": False,
    "heater_power": 1,
    "speed_deg_s": 170,
    "acceleration_deg_s2": 700,
    "rest_s": 0.5,
}
SCALE, SCALE_PER_K = np.array([1.1771, 1.1554, 1.1440]), np.array([3e-4, -2e-4, 3e-4])
BIAS_RAD_S, BIAS_PER_K = np.array([0.0077, -0.0100, -0.0051]), np.array([5e-4, -4e-4, 3e-4])
BODY: dict[str, Any] = {"start_c": 23, "capacity_j_k": 3, "loss_w_k": 0.1, "own_w": 0.1, "heater_w": 5}
LABORATORY: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"gyro": {"rate_hz": 59.5, "range_deg_s": 500}},
    "limits": {"bias_rad_s": 1, "bias_std_rad_s": 1, "scale_std": 1},
    "world": {
        "time_scale": 8,
        "thermal": BODY,
        "sensors": {
            "gyro": {
                "scale": SCALE.tolist(),
                "bias_rad_s": BIAS_RAD_S.tolist(),
                "noise_rad_s": 0.004,
                "temperature_c": 30,
                "scale_per_k": SCALE_PER_K.tolist(),
                "bias_rad_s_per_k": BIAS_PER_K.tolist(),
            }
        },
    },
}


# A whole range takes half a minute of a processor. `make test` has the first set and the heater after it, a range that
# is not reached, and the frozen recording of a range.
WHOLE_RANGE = pytest.mark.thorough


def of_events(run: RunData, kind: type) -> list[Any]:
    return [recorded.event for recorded in run.events if isinstance(recorded.event, kind)]


def thermal(folder: Path, procedure: dict[str, Any], body: dict[str, Any]) -> tuple[int, str, Path]:
    """A run of such a procedure with such a body: its exit status, what it said, its folder."""
    laboratory = merge(LABORATORY, {"world": {"thermal": body}})
    config, out = configuration(folder, laboratory, {**PROCEDURE, **procedure}), folder / "run"
    ended = rig("run", config, "--out", out, "--yes")
    return ended.returncode, ended.stdout + ended.stderr, out


@pytest.fixture(scope="module")
def heated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that a heater took through the range."""
    status, said, out = thermal(tmp_path_factory.mktemp("heated"), {}, {})
    assert status == 0, said
    return out


@WHOLE_RANGE
def test_a_heater_takes_the_sensors_through_the_range(heated: Path) -> None:
    run = read_run(heated / "run.h5")
    sets = of_events(run, SetMeasured)
    temperatures = sorted(each.temperatures_c["gyro"] for each in sets)
    assert temperatures[0] <= 26 and temperatures[-1] >= 38
    assert max(b - a for a, b in pairwise(temperatures)) <= 5
    assert complete_sweeps(run) == set(range(6 * len(sets)))
    assert [(each.first, each.end) for each in sets] == [(6 * k, 6 * k + 6) for k in range(len(sets))]
    assert all(event.heated for event in of_events(run, TemperatureWanted))
    assert run.settings.reference_c == 30


@WHOLE_RANGE
def test_the_heater_goes_on_while_the_rig_looks_at_its_sweeps(heated: Path) -> None:
    """It goes off 2 s after the last word from the host; then this body loses half a kelvin in a second.

    On a busy machine it may go off for a moment, but not for as long as it takes to find a revolution there.
    """
    run = read_run(heated / "run.h5")
    cooling = [event for event in run.events if isinstance(event.event, TemperatureWanted) and not event.event.warming]
    samples = run.samples["gyro"]
    warming = samples["host_time_s"] < min((each.host_time_s for each in cooling), default=np.inf)
    warm = run.sensors["gyro"].channel(TEMPERATURE).values(samples[warming]).ravel()
    assert (np.maximum.accumulate(warm) - warm).max() < 4


@WHOLE_RANGE
def test_its_result_has_what_the_world_makes_of_the_sensor(heated: Path) -> None:
    """Twice U is allowed: chance has eighteen values to move, and each slope left out would be ten times as much."""
    entry = read_result(heated).over_temperature["gyro"]["rate"]
    for row in (entry.table[4], entry.table[12]):
        warmer_k = row.temperature_c - 30
        scale = SCALE * (1 + SCALE_PER_K * warmer_k)
        bias = BIAS_RAD_S + BIAS_PER_K * warmer_k
        assert (np.abs(np.array(row.scale) - scale) <= 2 * np.array(row.expanded_scale)).all(), row
        assert (np.abs(np.array(row.bias) - bias) <= 2 * np.array(row.expanded_bias)).all(), row
    cold, warm = (np.array(entry.evaluate(entry.table[k].temperature_c)).ravel() for k in (4, 12))
    apart_k = entry.table[12].temperature_c - entry.table[4].temperature_c
    true = np.concatenate([SCALE * SCALE_PER_K, BIAS_PER_K]) * apart_k
    powers = [(entry.table[12].temperature_c - 30) ** n - (entry.table[4].temperature_c - 30) ** n for n in range(4)]
    rows = np.kron(np.eye(2), np.kron(powers, np.eye(3)))
    expanded = 2 * np.sqrt(np.diag(rows @ np.array(entry.covariance) @ rows.T))
    assert (np.abs(warm - cold - true) <= 2 * expanded).all(), (warm - cold - true, expanded)
    # How far a bias wanders is told by few readings, and U by that: by 0.25 of these slopes, and once by 0.41.
    assert (expanded < np.abs(true)).all(), "a sensor without slopes would not be told from this one"


FORCE_BIAS_PER_K, FORCE_SCALE_PER_K = np.array([2e-3, -1e-3, 3e-3]), np.array([1e-4, -1e-4, 5e-5])
FELT = merge(
    LABORATORY,
    {
        "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
        "limits": {
            "acceleration_scale_deviation": 0.1,
            "acceleration_scale_std": 0.1,
            "acceleration_bias_m_s2": 1,
            "acceleration_bias_std_m_s2": 1,
            "acceleration_verification_m_s2": 1,
        },
        "world": {
            "time_scale": 4,
            "sensors": {
                "gyro": {
                    "accelerometer": {
                        "scale": [1.012, 0.991, 1.006],
                        "bias_m_s2": [0.12, -0.2, 0.25],
                        "noise_m_s2": 0.01,
                        "bias_m_s2_per_k": FORCE_BIAS_PER_K.tolist(),
                        "scale_per_k": FORCE_SCALE_PER_K.tolist(),
                    }
                }
            },
        },
    },
)
IN_ATTITUDES = {"with_attitudes": True, "attitudes": "faces", "dwell_s": 1, "to_c": 40, "max_step_k": 5}


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.timeout(3000)
def test_attitudes_in_each_set_calibrate_the_accelerometer_over_temperature_too(tmp_path: Path) -> None:
    quick = {"speed_deg_s": 170, "acceleration_deg_s2": 700, "max_rate_k_per_min": 40}
    config, out = configuration(tmp_path, FELT, {**PROCEDURE, **IN_ATTITUDES, **quick}), tmp_path / "run"
    ended = rig("run", config, "--out", out, "--yes", timeout_s=2900)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    sets = of_events(read_run(out / "run.h5"), SetMeasured)
    assert len(sets) >= 4 and all(each.end - each.first == 6 + 12 for each in sets)
    found = read_result(out).over_temperature["gyro"]
    force_scale = np.array([1.012, 0.991, 1.006]) * FORCE_SCALE_PER_K
    true = {"rate": (SCALE * SCALE_PER_K, BIAS_PER_K), "acceleration": (force_scale, FORCE_BIAS_PER_K)}
    for quantity, (scale, bias) in true.items():
        std = np.sqrt(np.diag(found[quantity].covariance)).reshape(2, 4, 3)
        assert (np.abs(np.array(found[quantity].scale[1]) - scale) < 4 * std[0, 1]).all(), quantity
        assert (np.abs(np.array(found[quantity].bias[1]) - bias) < 4 * std[1, 1]).all(), quantity
        assert (4 * std[1, 1] < np.abs(bias)).all(), "a bias without slopes would not be told from this one"


@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("procedure", "body", "name"),
    [
        ({"heater_power": 0, "timeout_min": 0.2}, {}, "range_not_reached"),
        ({"heater_power": 0, "max_rate_k_per_min": 1}, {"air_c": [[0, 80]], "capacity_j_k": 60}, "too_fast"),
        ({"heater_power": 0, "max_temperature_c": 40.5, "max_rate_k_per_min": 100}, {"air_c": [[0, 80]]}, "overheated"),
        ({"repeats": 2}, {}, "range_not_reached"),
    ],
    ids=["nobody warms", "too fast", "overheated", "too few sets"],
)
def test_what_is_not_as_it_should_be_ends_by_name(
    tmp_path: Path, procedure: dict[str, Any], body: dict[str, Any], name: str
) -> None:
    status, said, out = thermal(tmp_path, procedure, body)
    assert status == 3 and f"rig: {name}:" in said, said
    run = read_run(out / "run.h5")
    assert len(run.samples["gyro"]) > 0
    assert max(abs(rate) for rate in run.states["qd_rad_s"][-1]) < 1e-6, "the arm has stopped"


@pytest.mark.thorough
def test_the_operator_is_told_what_is_wanted(tmp_path: Path, world: World) -> None:
    procedure = {"order": None, "directions": None, **PROCEDURE, "heater_power": 0}
    slow = {"world": {"thermal": {"capacity_j_k": 15}}}  # a set takes a part of a gap
    laboratory = world(merge(merge(LABORATORY, slow), {"procedure": procedure}))
    config, out = hardware(laboratory.config_path, tmp_path), tmp_path / "run"
    command = ("run", config, "--out", out, "--yes")
    with start_module(*command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as run:
        wait_for_log(out, "your turn: warm the board until it is at")
        laboratory.control({"do": "air", "temperature_c": 41})
        said = run.communicate(timeout=PATIENCE_S)[1]
    assert run.returncode in (0, 1), said
    assert not any(event.heated for event in of_events(read_run(out / "run.h5"), TemperatureWanted))


@pytest.mark.thorough
def test_an_interrupted_run_goes_on_with_its_sets(tmp_path: Path) -> None:
    config, out = configuration(tmp_path, LABORATORY, PROCEDURE), tmp_path / "run"
    command = ("run", config, "--out", out, "--yes")
    with start_module(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        wait_for_log(out, "set measured")
        wait_for_log(out, "done: sweep", times=8)
        run.send_signal(signal.SIGINT)
    first = of_events(read_run(out / "run.h5"), SetMeasured)
    ended = rig("resume", out, "--yes")
    assert ended.returncode in (0, 1), ended.stdout + ended.stderr
    again = read_run(out / "run-2.h5")
    assert 0 not in complete_sweeps(again), "a whole set is not made again"
    assert 6 * len(first) in complete_sweeps(again), "one that was interrupted is, from its beginning"


def test_a_killed_rig_leaves_the_heater_on_for_two_and_a_half_seconds_at_most(tmp_path: Path, world: World) -> None:
    laboratory = world(merge(LABORATORY, {"procedure": {"order": None, "directions": None, **PROCEDURE}}))
    config = hardware(laboratory.config_path, tmp_path)
    command = ("run", config, "--out", tmp_path / "run", "--yes")
    with start_module(*command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as run:
        goes_on = alive(run)
        wait_for(lambda: laboratory.control({"do": "heater"})["duty"] > 0, "the heater", meanwhile=goes_on)
        laboratory.control({"do": "hold"})
        run.kill()
        laboratory.control({"do": "advance", "duration_s": 2.5})
    assert laboratory.control({"do": "heater"})["duty"] == 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"to_c": 36, "reference_c": 30}, "3 gaps apart"),
        ({"to_c": 36, "both_directions": True}, "at least 10 K and a gap apart: 15 K"),
        ({"reference_c": 40}, "reference_c must lie between"),
        ({"reference_c": 26}, "half a gap from each"),
        ({"max_temperature_c": 34}, "max_temperature_c must lie above"),
        ({"to_c": 68}, "too hot for the heater"),
        ({"arc_deg": 180}, "leave it at 360"),
        ({"with_attitudes": True}, "attitudes calibrate accelerometers"),
    ],
)
def test_a_range_that_cannot_be_is_refused(tmp_path: Path, changes: dict[str, Any], words: str) -> None:
    config = configuration(tmp_path, LABORATORY, {**PROCEDURE, **changes})
    ended = rig_here("plan", config)
    assert ended.returncode == 2 and words in ended.stderr, ended.stderr


def test_the_plan_waits_before_each_set_and_has_attitudes_where_they_are_wanted(tmp_path: Path) -> None:
    with_force = merge(LABORATORY, {"sensors": {"gyro": {"acceleration": {"range_g": 2}}}})
    limits = {
        "acceleration_scale_deviation": 1,
        "acceleration_scale_std": 1,
        "acceleration_bias_m_s2": 9,
        "acceleration_bias_std_m_s2": 1,
        "acceleration_verification_m_s2": 1,
    }
    procedure = {**PROCEDURE, "with_attitudes": True, "attitudes": "faces", "repeats": 3}
    config = configuration(tmp_path, merge(with_force, {"limits": limits}), procedure)
    ended = rig_here("plan", config)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.count(" wait ") == 3
    assert ended.stdout.count("dwell at") == 3 * 12
