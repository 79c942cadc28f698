"""A run that goes wrong: the arm stops, the data stay, the error has a name, the exit status is the promised one."""

import json
import os
import pty
import re
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.data.recording.run_file import read_run
from support.fault_matrix.setups import SETUPS
from support.laboratories.commands import rig as command
from support.laboratories.worlds import World, WorldHandle, fresh_host, hardware, merge
from support.processes.system import descendant
from support.processes.waiting import PATIENCE_S, alive, wait_for
from support.processes.warm import start_module
from support.wires.arm_relay import relay

# The driver names each of these faults as well (tests/turners/ur/test_driver.py): a few whole runs are enough.
THOROUGH = [pytest.mark.proof, pytest.mark.thorough]
pytestmark = pytest.mark.slow

Start = Callable[..., "RunningRig"]

# Slow enough to see how long the arm goes on after a fault, and soon in its first sweep.
SOON_SWEEPING: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "procedure": {"rest_s": 0.5},
    "world": {"time_scale": 2},
}


# The simulated controllers: by `make proof` every accident happens on both, the essential ones by `make test` too.
KINDS: dict[str, dict[str, Any]] = {
    "PolyScope 5": {},
    "PolyScope X": {"arm": {"robot_api_port": 8077}, "world": {"arm": {"polyscope": "10.14.0.0"}}},
}
# What kills a program under a PolyScope 5 is asked of the driver too, in tests/turners/ur/test_driver.py.
both = pytest.mark.parametrize("start", [pytest.param("PolyScope 5", marks=THOROUGH), "PolyScope X"], indirect=True)


class RunningRig:
    """`rig run` on a world that stays when the run ends, so that a test can ask what the arm does."""

    def __init__(self, world: WorldHandle, folder: Path, *arguments: str) -> None:
        config = hardware(world.config_path, folder)
        self.world = world
        self.out = folder / "run"
        self.process = start_module(
            "run",
            config,
            "--out",
            self.out,
            *arguments,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def driver(self) -> int:
        """The process that drives the arm, which is in a session of its own."""
        return descendant(self.process.pid, "spawn_main")

    def send(self, number: int) -> None:
        """A signal to the command and all its processes in the foreground, as a terminal sends it."""
        os.killpg(self.process.pid, number)

    def until(self, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Wait for a state of the world."""
        states: list[dict[str, Any]] = []

        def so() -> bool:
            states[:] = [self.world.state()]
            return condition(states[0])

        wait_for(so, "a state of the world", meanwhile=alive(self.process))
        return states[0]

    def until_sweeping(self) -> None:
        """Wait until wrist 3 turns clockwise through the middle of its first sweep."""
        self.until(lambda state: state["qd_rad_s"][5] < -0.5 and abs(state["q_rad"][5]) < 1.0)

    def until_sweeping_slowly(self) -> None:
        """… in a laboratory that goes on half as fast as a real one: the rest of the sweep takes eight seconds."""
        self.until_sweeping()
        self.world.control({"do": "pace", "time_scale": 0.5})

    @property
    def moving(self) -> bool:
        return bool(self.world.state()["moving"])

    def stops_in_its_sweep(self) -> bool:
        """Whether the arm comes to stand before the end of the sweep."""
        wait_for(lambda: not self.moving, "that the arm stands")
        return bool(abs(self.world.state()["q_rad"][5]) < 3.0)

    def end(self) -> tuple[int, str]:
        """Exit status and stderr."""
        _, errors = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in errors
        return self.process.returncode, errors


@pytest.fixture(params=["PolyScope 5", pytest.param("PolyScope X", marks=THOROUGH)])
def start(world: World, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Start]:
    running: list[RunningRig] = []

    def run(changes: dict[str, Any] | None = None, *arguments: str, before: Any = None) -> RunningRig:
        handle = world(merge(merge(KINDS[request.param], SOON_SWEEPING), changes or {}))
        if before is not None:
            handle.control(before)
        running.append(RunningRig(handle, tmp_path, *(arguments or ("--yes",))))
        return running[-1]

    yield run
    for each in running:
        each.process.kill()
        each.process.communicate()


@contextmanager
def ignored(number: signal.Signals) -> Iterator[None]:
    """What is started within ignores the signal at first."""
    before = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(number, before)


@pytest.mark.parametrize(
    "number",
    [
        # All have one handler; which they are, tests/data/test_ending_signals.py holds. Of `make test` it is SIGINT, in
        # test_no_signal_after_the_first_kills_the_program_before_the_arm_stands.
        pytest.param(signal.SIGINT, marks=THOROUGH),
        *(
            pytest.param(each, marks=THOROUGH)
            for each in (signal.SIGTERM, signal.SIGQUIT, signal.SIGTSTP, signal.SIGUSR1)
        ),
        *(pytest.param(each, marks=THOROUGH) for each in (signal.SIGHUP, signal.SIGUSR2, signal.SIGPROF, 40)),
    ],
)
def test_an_interrupt_stops_the_arm_in_its_sweep(start: Start, number: int) -> None:
    """Also if the process that drives the arm gets it too."""
    rig = start()
    rig.until_sweeping_slowly()
    driver = rig.driver()
    rig.send(number)
    if number != signal.SIGTERM:
        os.kill(driver, number)
    assert rig.stops_in_its_sweep()
    status, errors = rig.end()
    assert status == 130
    assert re.search(r"interrupted( by SIG\w+| by signal \d+)?; the arm is stopped and at rest; ", errors), errors
    assert f"rig resume {rig.out}" in errors
    assert not rig.world.state()["program_running"]
    run = read_run(rig.out / "run.h5")
    assert len(run.samples["gyro"]) > 0 and len(run.states) > 0


@pytest.mark.thorough
def test_a_run_that_a_script_has_started_in_the_background_stops_by_an_interrupt_too(start: Start) -> None:
    with ignored(signal.SIGINT):
        rig = start()
    rig.until_sweeping_slowly()
    rig.send(signal.SIGINT)
    assert rig.stops_in_its_sweep()
    status, errors = rig.end()
    assert status == 130 and "interrupted; the arm is stopped and at rest; " in errors


@pytest.mark.thorough
def test_a_run_under_nohup_goes_on_when_its_terminal_closes(start: Start) -> None:
    quick = {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.5}
    known_less = {"scale_std": 0.005, "bias_std_rad_s": 0.01, "condition": 20}
    with ignored(signal.SIGHUP):
        rig = start({"procedure": quick, "limits": known_less, "world": {"time_scale": 8}})
    rig.until_sweeping()
    rig.send(signal.SIGHUP)
    status, errors = rig.end()
    assert status == 0, errors


@pytest.mark.parametrize("first", [signal.SIGINT, pytest.param(signal.SIGUSR1, marks=THOROUGH)])
def test_no_signal_after_the_first_kills_the_program_before_the_arm_stands(start: Start, first: int) -> None:
    rig = start()
    rig.until_sweeping_slowly()
    rig.send(first)
    for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGHUP, signal.SIGUSR1):
        rig.send(number)
    assert rig.stops_in_its_sweep()
    status, errors = rig.end()
    assert status == 130 and "the arm is stopped and at rest; " in errors.splitlines()[-1], errors
    assert f"rig resume {rig.out}" in errors and not rig.world.state()["program_running"]
    run = read_run(rig.out / "run.h5")
    assert len(run.samples["gyro"]) > 0 and len(run.states) > 0


@pytest.mark.thorough
def test_the_process_that_drives_the_arm_is_for_nobody_but_its_program_to_end(start: Start) -> None:
    rig = start()
    rig.until_sweeping()
    for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP, signal.SIGQUIT, signal.SIGINT, 40):
        os.kill(rig.driver(), number)
    rig.until(lambda state: state["qd_rad_s"][5] > 0.5)  # on its way back
    rig.send(signal.SIGINT)
    assert rig.end()[0] == 130


@pytest.mark.thorough
def test_three_ctrl_c_at_once_leave_the_word_that_the_arm_stands(start: Start) -> None:
    rig = start({"world": {"time_scale": 1}})
    rig.until_sweeping()
    for _ in range(3):
        rig.send(signal.SIGINT)
        time.sleep(0.05)
    status, errors = rig.end()
    assert status == 130
    assert "interrupted; the arm is stopped and at rest; " in errors.splitlines()[-1], errors


@both
def test_killing_all_processes_at_once_stops_the_arm(start: Start) -> None:
    rig = start()
    rig.until_sweeping_slowly()
    rig.send(signal.SIGKILL)
    assert rig.stops_in_its_sweep()
    rig.process.wait()
    wait_for(lambda: not rig.world.state()["program_running"], "the end of the program")


@pytest.mark.thorough
def test_resuming_a_run_that_still_goes_on_leaves_it_alone(start: Start) -> None:
    rig = start()
    rig.until_sweeping()
    second = command("resume", rig.out, "--yes")
    assert second.returncode == 2, second.stderr
    time_s = rig.world.state()["time_s"]
    rig.until(lambda state: state["time_s"] > time_s + 1.0)
    rig.send(signal.SIGINT)
    rig.end()
    run = read_run(rig.out / "run.h5")
    assert run.states["time_s"][-1] > time_s + 0.5, "what came after the second command is lost"


@pytest.mark.thorough
def test_a_program_held_up_for_a_second_misses_no_state(start: Start) -> None:
    rig = start({"world": {"time_scale": 8}})
    rig.until_sweeping()
    rig.process.send_signal(signal.SIGSTOP)
    time.sleep(1.0)
    rig.process.send_signal(signal.SIGCONT)
    rig.until(lambda state: state["qd_rad_s"][5] > 0.5)  # on its way back
    rig.send(signal.SIGINT)
    status, errors = rig.end()
    assert status == 130, errors
    np.testing.assert_allclose(np.diff(read_run(rig.out / "run.h5").states["time_s"]), 1 / 125, atol=1e-6)


def test_the_arm_stops_when_the_program_freezes(start: Start) -> None:
    rig = start()
    rig.until_sweeping_slowly()
    rig.process.send_signal(signal.SIGSTOP)
    assert rig.stops_in_its_sweep()
    rig.process.send_signal(signal.SIGCONT)
    assert rig.end()[0] == 3


# Of those that `make test` has time for only the first: a board without its cable ends a run in
# tests/commands/test_practise_a_fault.py, an arm that is gone in tests/turners/ur/test_driver.py.
@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("fault", "name"),
    [
        ({"do": "protective_stop"}, "protective_stop"),
        pytest.param({"do": "emergency_stop"}, "emergency_stop", marks=THOROUGH),
        pytest.param({"do": "pause"}, "arm_paused", marks=THOROUGH),
        pytest.param({"do": "stop_program"}, "program_stopped", marks=THOROUGH),
        pytest.param({"do": "speed_slider", "fraction": 0.5}, "speed_slider", marks=THOROUGH),
        ({"do": "close_arm"}, "arm_link_lost"),
        pytest.param({"do": "remote_control", "on": False}, "switched_to_local_control", marks=THOROUGH),
        pytest.param({"do": "payload", "mass_kg": 1.5}, "payload_changed", marks=THOROUGH),
        pytest.param({"do": "step_clock", "seconds": 1.0}, "arm_clock_stepped", marks=THOROUGH),
        pytest.param({"do": "safety_limit", "fraction": 0.6}, "speed_limited", marks=THOROUGH),
        pytest.param({"do": "encoder", "joint": 2, "error_rad": 6.283}, "arm_state_impossible", marks=THOROUGH),
        pytest.param({"do": "robot_mode", "name": "UPDATING_FIRMWARE"}, "arm_not_running", marks=THOROUGH),
        ({"do": "unplug_board"}, "board_link_lost"),
        pytest.param({"do": "silence_board", "on": True}, "board_link_lost", marks=THOROUGH),
        ({"do": "reset_board"}, "board_error"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_fault_during_a_sweep_stops_the_arm_and_keeps_the_data(
    start: Start, fault: dict[str, Any], name: str
) -> None:
    rig = start()
    rig.until_sweeping()
    rig.world.control(fault)
    status, errors = rig.end()
    assert status == 3
    assert f"rig: {name}: " in errors, errors
    assert f"rig resume {rig.out}" in errors
    assert not rig.moving
    assert len(read_run(rig.out / "run.h5").states) > 0


def test_nothing_moves_when_the_board_goes_while_the_sensors_are_first_listened_to(start: Start) -> None:
    rig = start(merge(SETUPS["imu"], {"world": {"time_scale": 1}}))
    began_s = rig.until(lambda state: state["program_running"])["time_s"]
    rig.world.control({"do": "pace", "time_scale": 0.2})
    rig.until(lambda state: state["time_s"] > began_s + 0.6)  # of 3 s
    rig.world.control({"do": "unplug_board"})
    status, errors = rig.end()
    assert status == 3 and "rig: board_link_lost: " in errors, errors
    run = read_run(rig.out / "run.h5")
    assert len(run.states) > 0 and not run.states["qd_rad_s"].any()
    assert run.states["time_s"][-1] < began_s + 5.0  # not only when the ten seconds for listening are over


def test_a_run_folder_that_is_removed_during_the_run_is_a_named_fault(start: Start) -> None:
    rig = start()
    rig.until_sweeping()
    shutil.rmtree(rig.out)
    status, errors = rig.end()
    assert status == 3 and "rig: run_folder_removed: " in errors, errors
    assert "rig resume" not in errors, "there is nothing to go on with"
    assert not rig.moving


@pytest.mark.proof
@pytest.mark.thorough
def test_resume_repeats_the_sweep_that_was_refused(start: Start) -> None:
    fast = {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.5}
    rig = start({"world": {"time_scale": 8}, "procedure": fast, "limits": {"scale_std": 1, "bias_std_rad_s": 1}})
    rig.until_sweeping()
    rig.world.control({"do": "host_baud", "baud": 115200})
    rig.until(lambda state: state["q_rad"][5] < -2)
    rig.world.control({"do": "host_baud", "baud": None})
    status, errors = rig.end()
    assert status == 3 and "rig: lost_samples: " in errors, errors

    resumed = command("resume", rig.out, "--yes")
    assert resumed.returncode == 0, resumed.stderr
    assert "resuming: 5 of 6 sweeps and dwells are recorded and valid" in resumed.stderr
    assert resumed.stderr.count("done: sweep") == 1
    result = json.loads((rig.out / "result.json").read_text(encoding="utf-8"))
    observations = result["gyroscopes"]["gyro"]["observations"]
    assert sorted(o["sweep"] for o in observations) == [0, 1, 2, 3, 4, 5]


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.parametrize("seconds", [1.0, -0.5])
def test_resume_goes_on_after_a_clock_that_was_set(start: Start, seconds: float) -> None:
    """What was recorded before it counts; nothing that came after it is in the file."""
    fast = {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.5}
    rig = start({"world": {"time_scale": 8}, "procedure": fast, "limits": {"scale_std": 1, "bias_std_rad_s": 1}})
    rig.until(lambda state: state["qd_rad_s"][4] < -0.5)  # wrist 2, after both sweeps of wrist 3
    rig.world.control({"do": "step_clock", "seconds": seconds})
    status, errors = rig.end()
    assert status == 3 and "rig: arm_clock_stepped: " in errors, errors
    assert np.all(np.diff(read_run(rig.out / "run.h5").states["time_s"]) < 0.1)
    resumed = command("resume", rig.out, "--yes")
    assert resumed.returncode == 0, resumed.stderr
    assert "resuming: 2 of 6" in resumed.stderr or "resuming: 3 of 6" in resumed.stderr, resumed.stderr


@pytest.mark.proof
@pytest.mark.thorough
def test_resume_goes_on_with_an_arm_that_answers_elsewhere(start: Start) -> None:
    fast = {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.5}
    rig = start({"world": {"time_scale": 8}, "procedure": fast, "limits": {"scale_std": 1, "bias_std_rad_s": 1}})
    rig.until_sweeping()
    rig.send(signal.SIGINT)
    rig.end()
    with relay(rig.world.host) as wire:
        resumed = command("resume", rig.out, "--yes", "--set", f"arm.host={wire.host}")
    assert resumed.returncode == 0, resumed.stderr
    assert f"at {wire.host}" in resumed.stderr


@pytest.mark.one_in(5)  # tests/firmware_host/test_client.py names what is wrong with a board
@pytest.mark.parametrize(
    ("fault", "name"),
    [
        ({"do": "speed_slider", "fraction": 0.5}, "speed_slider"),
        pytest.param({"do": "remote_control", "on": False}, "not_in_remote_control", marks=THOROUGH),
        ({"do": "power_off"}, "arm_not_running"),
        ({"do": "unplug_board"}, "no_"),
        ({"do": "silence_board", "on": True}, "no_board"),
        ({"do": "host_baud", "baud": 115200}, "wrong_baud_rate"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_wrong_before_the_start_is_refused_and_nothing_moves(
    start: Start, fault: dict[str, Any], name: str
) -> None:
    rig = start(before=fault)
    status, errors = rig.end()
    assert status == 2
    assert f"rig: {name}" in errors, errors
    state = rig.world.state()
    assert not state["moving"] and state["q_rad"][5] == pytest.approx(0, abs=1e-6)


def test_nothing_moves_when_nobody_agrees(start: Start) -> None:
    rig = start(None, "--json")
    status, errors = rig.end()
    assert status == 2
    assert "First it goes home" in errors and "rig: not_confirmed: " in errors
    assert not rig.out.exists(), "the same command can be given again"
    assert rig.world.state()["q_rad"][5] == pytest.approx(0, abs=1e-6)


def test_an_arm_that_was_moved_while_the_operator_thought_is_not_driven(world: World, tmp_path: Path) -> None:
    handle = world()
    config = hardware(handle.config_path, tmp_path)
    operator, terminal = pty.openpty()
    with start_module("run", config, "--out", tmp_path / "run", stdin=terminal, stderr=terminal) as process:
        os.close(terminal)
        said = b""
        while b"Type go to start" not in said:
            said += os.read(operator, 4096)
        with socket.create_connection((handle.host, 30002)) as pendant:
            pendant.sendall(b"def nudge():\n movej([0.2, -1.57, 1.57, -1.57, -1.57, 0], a=1.4, v=1.0)\nend\n")
            wait_for(lambda: handle.state()["q_rad"][0] > 0.19 and not handle.state()["program_running"], "the nudge")
        os.write(operator, b"go\n")
        with suppress(OSError):  # a terminal whose other end has closed
            while more := os.read(operator, 4096):
                said += more
        assert process.wait(PATIENCE_S) == 2
    os.close(operator)
    assert b"rig: arm_moved: " in said, said
    assert handle.state()["q_rad"][0] == pytest.approx(0.2, abs=1e-3)


def test_check_looks_and_moves_nothing(world: World, tmp_path: Path) -> None:
    handle = world()
    config = hardware(handle.config_path, tmp_path)
    ready = command("check", config)
    assert ready.returncode == 0 and ready.stdout.endswith("ready\n"), ready.stderr
    assert "sensor gyro: LSM9DS1, identity register 0x68" in ready.stdout

    handle.control({"do": "speed_slider", "fraction": 0.3})
    handle.control({"do": "unplug_board"})
    taken = ("input_int_register_7", "input_double_register_41")
    for name in taken:
        handle.control({"do": "register_in_use", "name": name})
    missing = command("check", config)
    assert missing.returncode == 2 and "not ready: 3 to correct" in missing.stdout
    assert "missing: speed_slider: the speed slider is at 30 %" in missing.stderr
    assert "missing: registers_in_use: " in missing.stderr and "URCaps" in missing.stderr
    state = handle.state()
    assert not state["program_running"] and not state["moving"] and state["claims"] == sorted(taken)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fault", "name"),
    [
        ({"do": "kvh_power", "on": False}, "kvh_link_lost"),
        pytest.param({"do": "kvh_fault", "status": 0x75}, "kvh_axis_invalid", marks=THOROUGH),
        pytest.param({"do": "kvh_fault", "lose": 200}, "kvh_gap_ambiguous", marks=THOROUGH),
    ],
)
def test_a_sensor_on_its_own_port_that_fails_ends_the_run(start: Start, fault: dict[str, Any], name: str) -> None:
    kvh = {"part": "kvh1775", "serial_number": "1775-1", "rate_hz": 250}
    port = {"port": f"socket://{fresh_host()}:7331"}
    truth = {"scale": [1.0, 1.0, 1.0], "bias_rad_s": [0.0, 0.0, 0.0], "noise_rad_s": 1e-4}
    rig = start(
        {"sensors": {"kvh": {**kvh, "serial": port}}, "world": {"time_scale": 2, "sensors": {"kvh": truth}}},
    )
    rig.until_sweeping()
    rig.world.control({**fault, "sensor": "kvh"})
    status, errors = rig.end()
    assert status == 3 and name in errors and "the arm is stopped" in errors
    assert not rig.world.state()["moving"]
    run = read_run(rig.out / "run.h5")
    assert len(run.samples["kvh"]) > 100 and len(run.samples["gyro"]) > 100, "the data are kept"
