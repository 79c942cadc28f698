"""The arm driver with the real client against the simulated controller: moves, states, stops, faults by name."""

import math
import multiprocessing
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from itertools import pairwise
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.errors import Fault, Refused
from rig.motion.carried import FlangeLoad
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.motion.steps import Transfer, trapezoid_duration
from rig.motion.turner_state import ArmState, Joints
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.turners.ur.arm_driver import Arm, look
from rig.turners.ur.arm_preflight import arm_problems
from rig.turners.ur.child.child_link import FROZEN_TICKS, TICK_S
from support.laboratories.worlds import World, WorldHandle, merge
from support.processes.waiting import PATIENCE_S, wait_for
from support.wires.arm_relay import ArmRelay, relay
from support.wires.rtde_reader import RtdeReader
from support.wires.ur10e import plan_problems

pytestmark = pytest.mark.slow

PAYLOAD = FlangeLoad(0.35, (0.0, 0.0, 0.025))
WRIST_3 = 5
FAST, SLOW = 4.0, 0.5  # … times a real laboratory's pace
LATE_S, BEHIND_S = 4.0, 5.0  # how long states come slowly, and how late they are then, by the controller's clock


# One that no register ends, as the client's own is by what the client has left there.
LEFT_BEHIND = b"def left_behind():\n while True:\n  sync()\n end\nend\n"

ROBOT_API_PORT = 8077  # which everybody may open
KINDS: dict[str, dict[str, Any]] = {
    "PolyScope 5": {},
    "PolyScope X": {"arm": {"robot_api_port": ROBOT_API_PORT}, "world": {"arm": {"polyscope": "10.14.0.0"}}},
}
# Every test is made on both kinds by `make proof`; by `make test` on both where `both` says so.
LATER = pytest.param("PolyScope X", marks=[pytest.mark.proof, pytest.mark.thorough])
both = pytest.mark.parametrize("laboratory", list(KINDS), indirect=True)


@pytest.fixture(params=["PolyScope 5", LATER])
def laboratory(world: World, request: pytest.FixtureRequest) -> WorldHandle:
    return world(merge(KINDS[request.param], {"world": {"time_scale": FAST}}))


def driver(world: WorldHandle, on_state: Callable[[ArmState], None] = lambda state: None, **options: Any) -> Arm:
    return Arm(world.host, on_state, robot_api_port=ROBOT_API_PORT, **options)


SWAYING = {
    "vibration_measured_rms_rad_s": 0.004,
    "vibration_measured_hz": 1.5,
}  # at most moments one joint seems to move


def test_an_arm_that_sways_on_its_base_is_reported_at_rest(world: World) -> None:
    with driver(world({"world": {"arm": SWAYING}})) as arm:
        assert all(arm.report().state.at_rest for _ in range(5))


def turn(start: Joints, angle_rad: float) -> Transfer:
    """A move of wrist 3 alone at 1 rad/s."""
    target = (*start[:WRIST_3], start[WRIST_3] + angle_rad)
    return Transfer("test move", start, target, 1.0, 2.0, trapezoid_duration(abs(angle_rad), 1.0, 2.0))


def stands(world: WorldHandle) -> bool:
    state = world.state()
    return not state["moving"] and state["runtime_state"] == "STOPPED"


def slowly(world: WorldHandle) -> None:
    """Let it go on so slowly that a move of 6 rad lasts a dozen seconds, enough for whoever is to stop it."""
    world.control({"do": "pace", "time_scale": SLOW})


def hang_and_await_the_stop(world: WorldHandle, child: BaseProcess, how: signal.Signals = signal.SIGSTOP) -> None:
    """Let the arm go on slowly, but brake fast: a stop is confirmed within a second of wall time, or not at all."""
    slowly(world)
    os.kill(child.pid or 0, how)
    wait_for(lambda: world.state()["runtime_state"] != "PLAYING", "braking")
    world.control({"do": "pace", "time_scale": FAST})
    wait_for(lambda: stands(world), "rest")


def on_its_way(world: WorldHandle) -> bool:
    """Whether a move of 6 rad has not come to its end."""
    return bool(abs(world.state()["q_rad"][WRIST_3]) < 5.5)


def upload(world: WorldHandle, program: bytes) -> None:
    with socket.create_connection((world.host, 30002)) as client:
        client.sendall(program)


def runs_when_uploaded(world: WorldHandle, program: bytes) -> bool:
    """Whether a program runs a moment after this one; a client that finds its arm again may end it by its own."""
    upload(world, program)
    end_s = time.monotonic() + 1.0
    while not (running := world.state()["program_running"]) and time.monotonic() < end_s:
        pass
    return bool(running)


class AtSpeed:
    """A watch that acts once, when the arm has reached its speed."""

    def __init__(self, arm: Arm, act: Callable[[], object]) -> None:
        self._arm, self._act, self._acted = arm, act, False

    def __call__(self) -> None:
        if not self._acted and abs(self._arm.latest.qd_rad_s[WRIST_3]) > 0.8:
            self._acted = True
            self._act()


@pytest.mark.thorough
@both
def test_a_look_moves_nothing_and_stops_no_program(laboratory: WorldHandle) -> None:
    with driver(laboratory) as other:
        other.take_control(PAYLOAD)
        report = look(laboratory.host, ROBOT_API_PORT)
        assert report.program_running
        assert report.remote_control
        assert report.serial_number.isdigit()
        with driver(laboratory) as second, pytest.raises(Refused) as refused:
            second.take_control(PAYLOAD)
        assert refused.value.name == "program_running"
        assert laboratory.state()["program_running"]
    assert stands(laboratory)


def test_no_arm_at_the_address_is_refused_by_name() -> None:
    with pytest.raises(Refused) as refused:
        look("127.0.3.250")
    assert refused.value.name == "no_arm"


def test_an_arm_that_sends_no_states_is_refused_by_name() -> None:
    def greet(listener: socket.socket) -> None:
        client, _ = listener.accept()
        client.sendall(b"Connected: Universal Robots Dashboard Server\n")
        client.close()

    with socket.create_server(("127.0.3.251", 29999)) as dashboard:
        greeter = threading.Thread(target=greet, args=(dashboard,))
        greeter.start()
        with pytest.raises(Refused) as refused:
            look("127.0.3.251")
        greeter.join()
    assert refused.value.name == "no_arm_states"


def test_moves_arrive_in_time_and_states_come_without_gaps(world: World) -> None:
    laboratory = world({"world": {"time_scale": SLOW}})  # so that little of its time passes between two moves
    angle_rad, states = 0.4, list[ArmState]()
    with driver(laboratory, states.append, state_rate_hz=500) as arm:
        arm.take_control(PAYLOAD)
        assert laboratory.state()["payload_kg"] == pytest.approx(PAYLOAD.payload_kg)
        out = turn(arm.latest.q_rad, angle_rad)
        began_s = arm.latest.time_s
        arm.move(out)
        arm.rest(0.2)
        arm.move(turn(out.target_q_rad, -angle_rad))
        took_s = arm.latest.time_s - began_s
        outcome = arm.stop()
        assert outcome.at_rest
        assert arm.stop() == outcome
        np.testing.assert_allclose(laboratory.state()["q_rad"], out.start_q_rad, atol=2e-4)
    assert took_s >= 2 * out.duration_s + 0.2 - 0.02  # and as much more as this computer takes from one to the next
    assert arm.missed_states == 0
    times_s = [state.time_s for state in states]
    np.testing.assert_allclose(np.diff(times_s), 1 / 500, atol=1e-9)
    record = np.array([state.to_record() for state in states], ARM_STATE_DTYPE)
    assert np.ptp(record["q_rad"][:, WRIST_3]) == pytest.approx(angle_rad, abs=1e-3)
    moving = np.abs(record["qd_rad_s"][:, WRIST_3]) > 0.03  # a joint comes back by less where it settles
    begins, ends = np.flatnonzero(np.diff(np.r_[False, moving, False].astype(int))).reshape(-1, 2).T
    np.testing.assert_allclose(record["time_s"][ends - 1] - record["time_s"][begins], [out.duration_s] * 2, atol=0.04)
    assert np.all(np.diff(record["time_s"]) > 0)
    assert np.all(np.diff(record["host_time_s"]) > 0)


@pytest.mark.thorough
def test_a_planned_sweep_turns_a_whole_revolution_at_its_speed(laboratory: WorldHandle) -> None:
    report = look(laboratory.host)
    procedure = SixObservationSection(speed_deg_s=120, acceleration_deg_s2=400)
    plan = plan_six_observation(ArmSection(host=laboratory.host, payload_kg=0.35), procedure, report.state.q_rad)
    assert plan_problems(plan, PAYLOAD) + arm_problems(plan, report) == []
    states: list[ArmState] = []
    sweep = plan.sweeps[0]
    with driver(laboratory, states.append) as arm:
        arm.take_control(PAYLOAD)
        for motion in plan.motions[: plan.motions.index(sweep)]:
            arm.move(motion)
        began_s = arm.latest.time_s
        arm.move(sweep)
    low, high = sweep.revolution_rad
    inside = [s for s in states if s.time_s > began_s and low < s.q_rad[sweep.joint] < high]
    turned_rad = inside[-1].q_rad[sweep.joint] - inside[0].q_rad[sweep.joint]
    assert turned_rad == pytest.approx(-2 * math.pi, abs=0.1)
    assert turned_rad / (inside[-1].time_s - inside[0].time_s) == pytest.approx(-sweep.speed_rad_s, rel=0.01)


@pytest.mark.one_in(9)
@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("protective_stop", {"do": "protective_stop"}),
        ("emergency_stop", {"do": "emergency_stop"}),
        ("arm_not_running", {"do": "power_off"}),
        ("arm_paused", {"do": "pause"}),
        ("program_stopped", {"do": "stop_program"}),
        ("speed_slider", {"do": "speed_slider", "fraction": 0.5}),
        ("arm_link_lost", {"do": "close_arm"}),
        ("arm_link_lost", {"do": "silence_arm", "duration_s": 8.0}),  # a crowd stretches how long it may be silent
        ("arm_link_lost", {"do": "hold"}),  # the controller's time stands still
    ],
)
def test_a_fault_during_a_move_is_named_and_the_arm_stands_still(
    laboratory: WorldHandle, name: str, order: dict[str, Any]
) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        watch = AtSpeed(arm, lambda: laboratory.control(order))
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), watch)
        assert fault.value.name == name
        assert "test move" in fault.value.what or "127." in fault.value.what
        assert fault.value.remedy
        laboratory.control({"do": "run"})
        wait_for(lambda: stands(laboratory), "rest")


def test_somebody_elses_program_in_place_of_ours_is_noticed_and_stopped(laboratory: WorldHandle) -> None:
    """It runs a moment later: the states show ours stopped for 20 ms."""
    nudge = b"def nudge():\n movej([0.0, -1.57, 1.57, -1.57, -1.57, -6.0], a=2, v=1)\nend\n"
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, lambda: upload(laboratory, nudge)))
        assert fault.value.name == "program_stopped"
        assert stands(laboratory) and laboratory.state()["q_rad"][WRIST_3] > -3.0


@pytest.mark.one_in(2)
@both
def test_a_program_that_a_reconnecting_client_leaves_behind_is_stopped(laboratory: WorldHandle) -> None:
    """No state confirms the stop, and a program runs again before the client is ended."""
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault):
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, lambda: laboratory.control({"do": "hold"})))
        laboratory.control({"do": "run"})
        wait_for(lambda: not laboratory.state()["program_running"], "the end of the program")
        wait_for(lambda: runs_when_uploaded(laboratory, LEFT_BEHIND), "the program")
    wait_for(lambda: not laboratory.state()["program_running"], "the end of the program")


@pytest.mark.slow
def test_one_that_it_leaves_behind_a_stop_that_was_seen_is_stopped_too(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, lambda: laboratory.control({"do": "stop_program"})))
        assert "at rest" in fault.value.what
        wait_for(lambda: runs_when_uploaded(laboratory, LEFT_BEHIND), "the program")
    wait_for(lambda: not laboratory.state()["program_running"], "the end of the program")


@pytest.mark.one_in(3)
@both
@pytest.mark.parametrize(("name", "kind"), [("arm_driver_died", "SIGKILL"), ("arm_driver_hung", "SIGSTOP")])
def test_a_child_that_dies_or_hangs_mid_move_leaves_a_standing_arm_long_before_the_end_of_its_way(
    laboratory: WorldHandle, name: str, kind: str
) -> None:
    others = set(multiprocessing.active_children())
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        (child,) = set(multiprocessing.active_children()) - others
        watch = AtSpeed(arm, lambda: hang_and_await_the_stop(laboratory, child, signal.Signals[kind]))
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), watch)
        assert fault.value.name == name
        assert "the controller says that its program has ended" in fault.value.what
        assert "Look at the arm" in fault.value.remedy and "emergency stop" not in fault.value.remedy
        assert on_its_way(laboratory)


@pytest.mark.slow
def test_a_hung_child_is_answered_by_a_stop_also_when_no_descriptor_is_left(laboratory: WorldHandle) -> None:
    others = set(multiprocessing.active_children())
    with driver(laboratory) as arm, ExitStack() as used:
        arm.take_control(PAYLOAD)
        (child,) = set(multiprocessing.active_children()) - others

        def use_up_and_hang_the_child() -> None:
            slowly(laboratory)
            with suppress(OSError):
                while True:
                    used.enter_context(Path(os.devnull).open("rb"))
            os.kill(child.pid or 0, signal.SIGSTOP)

        limits = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, limits[1]))
        used.callback(resource.setrlimit, resource.RLIMIT_NOFILE, limits)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, use_up_and_hang_the_child))
        assert fault.value.name == "arm_driver_hung" and "its program has ended" in fault.value.what
        wait_for(lambda: stands(laboratory), "rest")
        assert on_its_way(laboratory)


@pytest.mark.thorough
@pytest.mark.parametrize("where", ["move", "rest"])
def test_ctrl_c_stops_the_arm_at_once_and_goes_on_to_the_caller(laboratory: WorldHandle, where: str) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        began_s = arm.latest.time_s

        def interrupt() -> None:
            slowly(laboratory)
            os.kill(os.getpid(), signal.SIGINT)

        with pytest.raises(KeyboardInterrupt):
            if where == "move":
                arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, interrupt))
            else:
                arm.rest(60.0, interrupt)
        assert stands(laboratory) and on_its_way(laboratory)
        assert laboratory.state()["time_s"] - began_s < 30.0, "it rested to the end"
        assert arm.stop().at_rest
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 1.0))
        assert fault.value.name == "arm_stopped"


@pytest.mark.slow
def test_three_ctrl_c_at_once_end_with_how_the_arm_was_left(world: World) -> None:
    laboratory = world({"world": {"time_scale": 1}})  # braking takes longer than the three

    def interrupt() -> None:
        os.kill(os.getpid(), signal.SIGINT)

    def interrupt_thrice() -> None:
        for delay_s in (0.03, 0.06):
            threading.Timer(delay_s, interrupt).start()
        interrupt()

    with pytest.raises(KeyboardInterrupt) as interrupted, driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, interrupt_thrice))
    assert interrupted.value.__notes__ == ["the arm is stopped and at rest"]
    assert stands(laboratory)


def test_an_error_of_the_watch_stops_the_arm_and_is_kept(laboratory: WorldHandle) -> None:
    def complain() -> None:
        raise Fault("board_link_lost", "the board is gone", "plug it in")

    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, complain))
        assert fault.value.name == "board_link_lost"
        assert stands(laboratory)


def test_what_the_watch_knows_already_keeps_the_arm_from_moving(laboratory: WorldHandle) -> None:
    def complain() -> None:
        raise Fault("board_link_lost", "the board is gone", "plug it in")

    states: list[ArmState] = []
    with driver(laboratory, states.append) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault):
            arm.move(turn(arm.latest.q_rad, 6.0), complain)
    assert states and not any(map(any, (state.qd_rad_s for state in states)))


def test_a_state_that_cannot_be_passed_on_stops_the_arm(laboratory: WorldHandle) -> None:
    def full(state: ArmState) -> None:
        if abs(state.qd_rad_s[WRIST_3]) > 0.8:
            raise OSError("no space left on device")

    with driver(laboratory, full) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0))
        assert "no space left on device" in fault.value.what
        assert stands(laboratory)


def outside_address() -> str | None:
    """Of this computer, as others know it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_way, suppress(OSError):
        any_way.connect(("192.0.2.1", 9))
        address = str(any_way.getsockname()[0])
        return None if address.startswith("127.") else address
    return None


@pytest.mark.thorough
@pytest.mark.skipif(outside_address() is None, reason="nobody else could reach this computer")
def test_an_arm_elsewhere_that_falls_silent_is_missed_at_once_on_a_crowded_computer(
    laboratory: WorldHandle, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By as crowded a one a controller here would be excused for hours."""
    monkeypatch.setattr("firmware_host.computer_load.MAX_LOAD_FACTOR", 1e6)
    monkeypatch.setattr(os, "getloadavg", lambda: (1e6, 1e6, 1e6))
    with relay(laboratory.host, outside_address()) as wire:
        with Arm(wire.host) as arm:
            arm.take_control(PAYLOAD)
            with pytest.raises(Fault) as fault:
                arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, wire.stalled.set))
        wire.stalled.clear()
    assert fault.value.name == "arm_link_lost"


@pytest.mark.thorough
@pytest.mark.usefixtures("no_crowd")
def test_a_program_that_comes_late_to_the_states_does_not_take_its_driver_for_hung(laboratory: WorldHandle) -> None:
    """The driver's heartbeats lie in the pipe meanwhile: whoever reads them is held up."""
    held_up = iter([1.0])

    def take(state: ArmState) -> None:
        if abs(state.qd_rad_s[WRIST_3]) > 0.8:
            time.sleep(next(held_up, 0.0))

    with driver(laboratory, take) as arm:
        arm.take_control(PAYLOAD)
        arm.move(turn(arm.latest.q_rad, 6.0))
        assert next(held_up, None) is None, "nothing was held up"
        assert arm.missed_states == 0


@pytest.mark.thorough
@pytest.mark.usefixtures("no_crowd")
def test_a_program_that_takes_no_more_states_is_noticed(world: World) -> None:
    laboratory = world({"world": {"time_scale": SLOW}})
    stuck = threading.Event()

    def take(state: ArmState) -> None:
        if abs(state.qd_rad_s[WRIST_3]) > 0.8:
            stuck.wait(PATIENCE_S)

    with driver(laboratory, take) as arm:
        arm.take_control(PAYLOAD)
        try:
            with pytest.raises(Fault) as fault:
                arm.move(turn(arm.latest.q_rad, 6.0))
            assert fault.value.name == "arm_driver_hung"
            assert on_its_way(laboratory), "the arm went on to the end of its way"
        finally:
            stuck.set()


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="only root takes a processor away, on Linux")
@pytest.mark.usefixtures("no_crowd")
def test_a_controller_on_this_machine_that_gets_no_processor_is_no_lost_link(laboratory: WorldHandle) -> None:
    """As where a virtual machine's host takes one of its processors away, without a crowd on the others."""
    states: list[ArmState] = []
    controller, processors = laboratory.process.pid, os.sched_getaffinity(0)
    taken = {max(processors)}

    def hold_up() -> None:
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as greedy:
            os.sched_setaffinity(greedy.pid, taken)
            os.sched_setaffinity(controller, taken)
            os.sched_setscheduler(greedy.pid, os.SCHED_FIFO, os.sched_param(1))  # leaves the others 5 %, once a second
            time.sleep(2.0)
            greedy.kill()
        os.sched_setaffinity(controller, processors)

    with driver(laboratory, states.append) as arm:
        arm.take_control(PAYLOAD)
        arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, hold_up))
        assert arm.missed_states == 0
    held_s = max(after.host_time_s - before.host_time_s for before, after in pairwise(states))
    assert held_s > TICK_S * (FROZEN_TICKS + 1), "it was not held up"


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what another program has not read")
@pytest.mark.usefixtures("no_crowd")
def test_a_slow_reader_beside_and_a_controller_held_up_for_a_moment_are_no_lost_link(laboratory: WorldHandle) -> None:
    """Neither is one alone. As in a busy moment: a part of the rig reads late, the laboratory gets no turn."""
    beside = RtdeReader(laboratory.host)
    read_until_s = math.inf

    def read() -> None:
        with suppress(OSError):
            while time.monotonic() < read_until_s:
                beside.newest_s()

    reading = threading.Thread(target=read)
    reading.start()
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        arm.rest(12.0)  # in which the other reader earns patience

        def hold_up() -> None:
            nonlocal read_until_s
            read_until_s = 0.0
            reading.join()
            time.sleep(0.6)
            os.kill(laboratory.process.pid, signal.SIGSTOP)
            time.sleep(0.5)
            os.kill(laboratory.process.pid, signal.SIGCONT)

        arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, hold_up))
    beside.close()


@pytest.mark.thorough
def test_a_controller_that_was_silent_before_a_move_has_not_refused_it(
    laboratory: WorldHandle, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "firmware_host.computer_load.load_factor", lambda: 5.0
    )  # so crowded that 3 s of silence are excused
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        laboratory.control({"do": "silence_arm", "duration_s": 3.0})
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 1.0))
    assert fault.value.name == "arm_link_lost", fault.value


def test_an_arm_slower_than_planned_is_stopped(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        move = turn(arm.latest.q_rad, 6.0)
        hurried = Transfer(move.name, move.start_q_rad, move.target_q_rad, 1.0, 2.0, duration_s=1.0)
        with pytest.raises(Fault) as fault:
            arm.move(hurried)
        assert fault.value.name == "arm_slower_than_planned"
        assert stands(laboratory)


@pytest.mark.thorough
def test_a_controller_that_is_gone_altogether_is_said_honestly(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        cut = AtSpeed(arm, lambda: laboratory.control({"do": "close_arm", "listen": False}))
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), cut)
    assert fault.value.name == "arm_link_lost"
    assert "the primary interface did not take the stop (" in fault.value.what
    assert "press the emergency stop" in fault.value.remedy


def test_a_dashboard_that_is_gone_leaves_the_primary_interface_to_stop_the_arm(world: World) -> None:
    """And nothing else: the driver's process is hung, which the client lives in."""
    laboratory = world({"world": {"time_scale": FAST}})
    others = set(multiprocessing.active_children())
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        (child,) = set(multiprocessing.active_children()) - others

        def close_the_dashboard_and_hang_the_child() -> None:
            laboratory.control({"do": "close_dashboard"})
            hang_and_await_the_stop(laboratory, child)

        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), AtSpeed(arm, close_the_dashboard_and_hang_the_child))
        assert fault.value.name == "arm_driver_hung" and "its program has ended" in fault.value.what
        assert stands(laboratory) and on_its_way(laboratory)


@pytest.mark.thorough
def test_a_speed_the_client_refuses_is_named(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(replace(turn(arm.latest.q_rad, 1.0), speed_rad_s=4.0))
        assert fault.value.name == "move_refused"
        assert stands(laboratory)


def test_a_move_beyond_the_limits_is_refused_by_the_controller_and_named(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 7.0))
        assert fault.value.name == "program_stopped"


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "orders"),
    [
        ("not_in_remote_control", [{"do": "remote_control", "on": False}]),
        ("registers_in_use", [{"do": "registers_in_use", "first": 0, "last": 47}]),
        ("protective_stop", [{"do": "protective_stop"}]),
        ("emergency_stop", [{"do": "emergency_stop"}]),
        ("speed_slider", [{"do": "speed_slider", "fraction": 0.5}]),
    ],
)
def test_control_is_refused_by_name_before_anything_moves(
    laboratory: WorldHandle, name: str, orders: list[dict[str, Any]]
) -> None:
    for order in orders:
        laboratory.control(order)
    with driver(laboratory) as arm:
        with pytest.raises(Refused) as refused:
            arm.take_control(PAYLOAD)
        assert refused.value.name == name
        assert refused.value.remedy
    assert not laboratory.state()["program_running"]


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("order", "words"),
    [
        ({"do": "remote_control", "on": False}, "the controller began no program that was sent to it there"),
        ({"do": "close_arm", "listen": False}, "the controller does not answer"),
    ],
    ids=["local control", "closed"],
)
def test_a_polyscope_x_that_cannot_be_stopped_is_not_moved(world: World, order: dict[str, Any], words: str) -> None:
    """Before 10.12 it does not tell whether it is in remote control, without which it takes no stop."""
    laboratory = world({"world": {"time_scale": FAST, "arm": {"polyscope": "10.10.0.0"}}})
    with driver(laboratory) as arm:
        assert arm.report().remote_control is None
        laboratory.control(order)
        with pytest.raises(Refused) as refused:
            arm.take_control(PAYLOAD)
    assert refused.value.name == "stop_not_proved" and words in refused.value.what
    assert not laboratory.state()["program_running"] and laboratory.state()["still_since_s"] == 0


@pytest.mark.thorough
def test_a_payload_the_controller_does_not_take_is_refused(laboratory: WorldHandle) -> None:
    with driver(laboratory) as arm, pytest.raises(Refused) as refused:
        arm.take_control(replace(PAYLOAD, payload_kg=20.0))
    assert refused.value.name == "payload_not_set"
    assert "20 kg" in refused.value.what
    assert stands(laboratory)


@pytest.mark.thorough
def test_states_that_are_read_late_are_no_refusal_of_the_payload(laboratory: WorldHandle) -> None:
    """As on a busy machine: what the driver reads is more than a second older than what the controller has taken."""

    def catch_up(wire: ArmRelay) -> None:
        wait_for(lambda: laboratory.state()["program_running"], "the program has begun")
        time.sleep(LATE_S)
        wire.slow.clear()

    laboratory.control({"do": "pace", "time_scale": 12})
    with relay(laboratory.host) as wire, Arm(wire.host) as arm:
        wire.slow_down()
        wait_for(lambda: laboratory.state()["time_s"] > arm.latest.time_s + BEHIND_S, "states wait to be read")
        later = threading.Thread(target=catch_up, args=(wire,))
        later.start()
        arm.take_control(PAYLOAD)
        later.join()
        assert laboratory.state()["payload_kg"] == pytest.approx(PAYLOAD.payload_kg)


def test_a_speed_slider_below_full_is_refused_in_preflight(laboratory: WorldHandle) -> None:
    laboratory.control({"do": "speed_slider", "fraction": 0.5})
    report = look(laboratory.host)
    plan = plan_six_observation(ArmSection(host=laboratory.host, payload_kg=0.35), SixObservationSection())
    (problem,) = arm_problems(plan, report)
    assert problem.name == "speed_slider"
    assert "50 %" in problem.what


PARENT = """
import sys
from rig.motion.carried import FlangeLoad
from rig.turners.ur.arm_driver import Arm
from rig.motion.steps import Transfer

if __name__ == "__main__":
    with Arm(sys.argv[1], robot_api_port=int(sys.argv[2])) as arm:
        arm.take_control(FlangeLoad(0.35, (0.0, 0.0, 0.025)))
        here = arm.latest.q_rad
        print("moving", flush=True)
        arm.move(Transfer("test move", here, (*here[:5], here[5] + 6.0), 1.0, 2.0, 6.5))
"""


@pytest.mark.one_in(6)
@pytest.mark.parametrize(
    ("laboratory", "kind"),
    [
        ("PolyScope 5", "SIGKILL"),
        ("PolyScope 5", "SIGTERM"),
        ("PolyScope 5", "SIGINT"),
        ("PolyScope 5", "SIGINT twice"),
        ("PolyScope X", "SIGKILL"),
        ("PolyScope X", "SIGINT"),
    ],
    indirect=["laboratory"],
)
def test_the_arm_is_stopped_when_the_program_itself_dies(laboratory: WorldHandle, tmp_path: Path, kind: str) -> None:
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    with subprocess.Popen(
        [sys.executable, str(script), laboratory.host, str(ROBOT_API_PORT)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"moving\n"
        wait_for(lambda: laboratory.state()["moving"], "motion")
        slowly(laboratory)
        if kind.startswith("SIGINT"):  # Ctrl-C in a terminal reaches the whole group
            os.killpg(parent.pid, signal.SIGINT)
            if kind.endswith("twice"):
                time.sleep(0.02)  # while the stop is under way
                os.killpg(parent.pid, signal.SIGINT)
        else:
            parent.send_signal(getattr(signal, kind))
        wait_for(lambda: stands(laboratory), "rest")
        assert on_its_way(laboratory)
        parent.wait(PATIENCE_S)
