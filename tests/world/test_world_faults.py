"""What the unmodified client sees when the simulated controller or its operator misbehaves.

The client runs in a process of its own: once it has lost its controller it may hang or crash at exit.
"""

import math
import os
import signal
import socket
import subprocess
from pathlib import Path

import pytest

from support.laboratories.worlds import World, WorldHandle, fresh_host
from support.processes.waiting import PATIENCE_S, wait_for
from support.processes.warm import start_module
from support.wires.arm_client import client

pytestmark = pytest.mark.slow


def moving(world: WorldHandle) -> bool:
    return bool(world.state()["qd_rad_s"][5] > 0.4)


BLOCKING_MOVE = "say(control.moveJ(there, 0.5, 4.0))"


@pytest.mark.parametrize("stop", ["protective_stop", "emergency_stop"])
def test_a_safety_stop_fails_the_move_at_once_and_stops_the_joints_quickly(world: World, stop: str) -> None:
    running = world()
    with client(running, BLOCKING_MOVE + "\nsay(control.moveJ(home)); say(control.isSteady())") as arm:
        wait_for(lambda: moving(running), "the move")
        running.control({"do": "hold"})
        running.control({"do": stop})
        running.control({"do": "advance", "duration_s": 0.05})
        state = running.state()
        running.control({"do": "run"})
        for _ in range(3):  # the move, and everything after it, silently
            arm.says("False")
    assert not state["moving"] and state["q_rad"][5] < 2.9
    assert state["safety_mode"] == ("PROTECTIVE_STOP" if stop == "protective_stop" else "ROBOT_EMERGENCY_STOP")


def test_a_protective_stop_leaves_an_asynchronous_move_running_for_ever_in_the_client(world: World) -> None:
    running = world()
    script = """
        control.moveJ(there, 0.5, 4.0, True)
        until(lambda: receive.getActualQd()[5] > 0.4)
        say("moving")
        until(lambda: not control.isProgramRunning())
        until(lambda: receive.isProtectiveStopped())
        say(control.getAsyncOperationProgress() >= 0, receive.getSafetyMode(), receive.getSafetyStatusBits() & 0b100)
    """
    with client(running, script) as arm:
        arm.says("moving")
        running.control({"do": "protective_stop"})
        arm.says("True 3 4")


@pytest.mark.thorough
def test_a_protective_stop_unlocks_after_five_seconds_and_the_script_can_be_sent_again(world: World) -> None:
    running = world()
    script = """
        from dashboard_client import DashboardClient
        dashboard = DashboardClient(host); dashboard.connect()
        say(control.triggerProtectiveStop())
        until(lambda: receive.isProtectiveStopped())
        stopped = receive.getTimestamp()
        try: dashboard.unlockProtectiveStop(); say("too early")
        except Exception as refusal: say("5s after" in str(refusal))
        until(lambda: receive.getTimestamp() > stopped + 5.1)
        dashboard.unlockProtectiveStop()
        until(lambda: not receive.isProtectiveStopped())
        say(control.reuploadScript())
        until(control.isProgramRunning)
        say(control.moveJ([*home[:5], 0.1], 1.0, 4.0))
    """
    with client(running, script) as arm:
        assert arm.next() in ("True", "False")  # the stop may come before the script says it is done
        for _ in range(3):
            arm.says("True")


@pytest.mark.thorough
def test_no_program_starts_while_the_robot_is_stopped(world: World) -> None:
    running = world()
    running.control({"do": "protective_stop"})
    script = "try: RTDEControlInterface(host); say('connected')\nexcept RuntimeError as error: say(error)"
    with client(running, script, connect=False) as arm:
        assert "Failed to start control script, before timeout of 5 seconds" in arm.next()


def test_stop_on_the_pendant_fails_the_move(world: World) -> None:
    running = world()
    with client(running, BLOCKING_MOVE) as arm:
        wait_for(lambda: moving(running), "the move")
        running.control({"do": "stop_program"})
        arm.says("False")
    wait_for(lambda: not running.state()["moving"], "the joints to rest")
    assert running.state()["q_rad"][5] < 2.9


def test_pause_fails_the_move_but_play_finishes_it(world: World) -> None:
    running = world()
    with client(running, BLOCKING_MOVE) as arm:
        wait_for(lambda: moving(running), "the move")
        running.control({"do": "pause"})
        arm.says("False")
        wait_for(lambda: running.state()["runtime_state"] == "PAUSED", "the pause")
        paused_at = running.state()["q_rad"][5]
        assert not running.state()["moving"] and paused_at < 2.9
        running.control({"do": "play"})
        wait_for(lambda: running.state()["q_rad"][5] == pytest.approx(3.0, abs=1e-9), "the end of the move")


def test_local_control_is_named_by_the_client(world: World) -> None:
    running = world({"world": {"arm": {"remote_control": False}}})
    script = "try: RTDEControlInterface(host)\nexcept RuntimeError as error: say(error)"
    with client(running, script, connect=False) as arm:
        assert "Please enable remote control on the robot!" in arm.next()
    running.control({"do": "remote_control", "on": True})
    with client(running, "say('here')") as arm:
        arm.says("here")


def test_registers_in_use_and_a_second_client(world: World) -> None:
    running = world()
    script = "try: RTDEControlInterface(host); say('connected')\nexcept RuntimeError as error: say(error)"
    running.control({"do": "register_in_use", "name": "input_double_register_3"})
    with client(running, script, connect=False) as arm:
        assert "already in use" in arm.next()
    running.control({"do": "register_free", "name": "input_double_register_3"})
    with client(running, BLOCKING_MOVE):
        wait_for(lambda: moving(running), "the first client's move")
        with client(running, script, connect=False) as second:
            assert "already in use" in second.next()
        assert running.state()["program_running"]  # the second client was turned away before it could stop anything
    wait_for(lambda: not running.state()["claims"], "the dead client's registers to be free")


def test_the_robot_goes_on_turning_when_the_client_dies_during_speedj(world: World) -> None:
    running = world()
    script = "control.speedJ([0, 0, 0, 0, 0, 0.5], 2.0); say('turning'); time.sleep(60)"
    with client(running, script) as arm:
        arm.says("turning")
        wait_for(lambda: moving(running), "the joint to turn")
    before = running.state()
    wait_for(lambda: running.state()["time_s"] > before["time_s"] + 1.0, "a second")
    after = running.state()
    assert after["q_rad"][5] - before["q_rad"][5] == pytest.approx(0.5 * (after["time_s"] - before["time_s"]), rel=0.1)


def test_two_threads_of_a_program_may_not_both_move_the_robot(world: World) -> None:
    running = world()
    script = """
        control.moveJ(there, 0.5, 4.0, True)
        until(lambda: receive.getActualQd()[5] > 0.4)
        control.speedJ([0, 0, 0, 0, 0, -0.5], 2.0)
        until(lambda: not control.isProgramRunning())
        say("program stopped")
    """
    with client(running, script) as arm:
        arm.says("program stopped")
    assert "another thread is already controlling the robot" in running.state()["messages"]


def test_a_target_beyond_the_joint_limits_stops_the_program(world: World) -> None:
    running = world()
    with client(running, "say(control.moveJ([*home[:5], 6.4]))") as arm:
        arm.says("False")
    assert any("out of limits" in text for text in running.state()["messages"])
    assert running.state()["q_rad"][5] == pytest.approx(0.0, abs=1e-9)


def test_a_silent_client_is_stopped_by_its_own_watchdog(world: World) -> None:
    running = world()
    with client(running, "control.setWatchdog(2.0); until(lambda: not control.isProgramRunning()); say('over')") as arm:
        arm.says("over")
    assert any("watchdog" in text for text in running.state()["messages"])


@pytest.mark.thorough
def test_a_short_silence_is_borne_and_a_long_one_drops_the_connection(world: World) -> None:
    running = world()
    script = """
        stamp = receive.getTimestamp()
        say("ready")
        until(lambda: receive.getTimestamp() > stamp + 15.0)
        say(receive.isConnected())
        until(lambda: not receive.isConnected())
        say("gone")
    """
    with client(running, script) as arm:
        arm.says("ready")
        running.control({"do": "silence_arm", "duration_s": 0.4})
        arm.says("True")
        running.control({"do": "silence_arm", "duration_s": 3600.0})
        arm.says("gone")


def test_closed_sockets_fail_the_move_and_freeze_the_reports(world: World) -> None:
    running = world()
    script = """
        import threading
        answer = []
        mover = threading.Thread(target=lambda: answer.append(control.moveJ(there, 0.5, 4.0)), daemon=True)
        mover.start()
        until(lambda: receive.getActualQd()[5] > 0.4)
        say("moving")
        until(lambda: not receive.isConnected())
        frozen = receive.getTimestamp()
        time.sleep(0.1)
        say(receive.getTimestamp() == frozen)
    """
    with client(running, script) as arm:
        arm.says("moving")
        running.control({"do": "close_arm", "listen": False})
        arm.says("True")
    with pytest.raises(OSError):
        socket.create_connection((running.host, 30004), 1.0)


def test_power_off_and_on_again(world: World) -> None:
    running = world()
    with client(running, BLOCKING_MOVE) as arm:
        wait_for(lambda: moving(running), "the move")
        running.control({"do": "power_off"})
        arm.says("False")
    wait_for(lambda: not running.state()["moving"], "the brakes")
    assert running.state()["robot_mode"] == "POWER_OFF"
    running.control({"do": "brake_release"})
    wait_for(lambda: running.state()["robot_mode"] == "RUNNING", "power and brakes")
    with client(running, "say(control.moveJ([*home[:5], 0.1], 1.0, 4.0))") as arm:
        arm.says("True")


def test_an_emergency_stop_takes_the_power_until_it_is_released(world: World) -> None:
    running = world()
    running.control({"do": "emergency_stop"})
    wait_for(lambda: running.state()["robot_mode"] == "POWER_OFF", "the power to go")
    running.control({"do": "power_on"})
    assert running.state()["robot_mode"] == "POWER_OFF"
    running.control({"do": "release"})
    running.control({"do": "power_on"})
    wait_for(lambda: running.state()["robot_mode"] == "IDLE", "the power")


@pytest.mark.proof
@pytest.mark.thorough
def test_the_slider_may_be_moved_during_a_move(world: World) -> None:
    running = world()
    with client(running, BLOCKING_MOVE) as arm:
        wait_for(lambda: moving(running), "the move")
        running.control({"do": "speed_slider", "fraction": 0.5})
        wait_for(lambda: running.state()["qd_rad_s"][5] < 0.3, "the slower speed")
        running.control({"do": "speed_slider", "fraction": 1.0})
        arm.says("True")
    assert running.state()["q_rad"][5] == pytest.approx(3.0, abs=1e-3)  # the joint settles


def test_a_held_clock_lets_tests_look_closely(world: World) -> None:
    running = world()
    running.control({"do": "hold"})
    start = running.state()["time_s"]
    assert running.state()["time_s"] == start and running.state()["held"]
    assert running.control({"do": "advance", "duration_s": 0.25})["time_s"] == pytest.approx(start + 0.25)
    assert running.state()["time_s"] == pytest.approx(start + 0.25)
    running.control({"do": "run"})
    wait_for(lambda: running.state()["time_s"] > start + 0.5, "the clock")


def test_wrong_requests_to_the_control_channel_are_answered(world: World) -> None:
    running = world()
    with pytest.raises(AssertionError, match="unknown request"):
        running.control({"do": "dance"})
    with pytest.raises(AssertionError, match="speed_slider"):
        running.control({"do": "speed_slider", "velocity": 1})
    with pytest.raises(AssertionError, match="one line of JSON"):
        running.control({"please": "dance"})


def refused(config: str | Path) -> tuple[int, str]:
    """Return the exit status and the errors of a world that cannot start."""
    process = start_module(config, module="rig.world", stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _, errors = process.communicate(timeout=PATIENCE_S)
    return process.returncode, errors


def test_a_taken_port_is_a_clear_error(world: World) -> None:
    running = world()
    status, errors = refused(running.config_path)
    assert status == 2
    assert f"cannot listen on {running.host}:29999" in errors and "Traceback" not in errors
    assert len(errors.strip().splitlines()) == 1


def test_a_configuration_without_a_world_is_refused() -> None:
    status, errors = refused("configs/ur10e_lsm9ds1.yaml")
    assert status == 2 and "Traceback" not in errors


def test_the_world_ends_with_its_input_and_ignores_the_terminals_interrupt(world: World) -> None:
    running = world()
    running.process.send_signal(signal.SIGINT)
    wait_for(lambda: running.state()["time_s"] > 0.0, "the first tick")
    running.stop()
    assert running.process.returncode == 0


@pytest.mark.parametrize("inherited", [signal.SIG_DFL, signal.SIG_IGN], ids=["by hand", "by a script's &"])
def test_ctrl_c_ends_a_world_in_the_foreground(world: World, inherited: signal.Handlers) -> None:
    running = world()
    text = running.config_path.read_text().replace(running.host, fresh_host())
    running.config_path.write_text(text)
    before = signal.signal(signal.SIGINT, inherited)
    try:
        process = start_module(running.config_path, module="rig.world", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    finally:
        signal.signal(signal.SIGINT, before)
    assert process.stdout is not None and process.stdout.readline()
    os.kill(process.pid, signal.SIGINT)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode in (0, 130) and b"Traceback" not in errors, (output, errors)


def test_angles_are_in_radians_everywhere(world: World) -> None:
    assert world().state()["q_rad"][1] == pytest.approx(-math.pi / 2, abs=1e-9)
