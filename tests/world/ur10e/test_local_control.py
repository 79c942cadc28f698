"""The simulated controller in local control: it refuses every order as a real one does, and answers questions."""

import json
import socket
from contextlib import closing
from functools import partial

import pytest

from rig.world.clock import TICKS_PER_SECOND
from rig.world.laboratory import Laboratory
from rig.world.ur10e.controller_messages import READ_ONLY
from rig.world.ur10e.interfaces.dashboard_server import REMOTE_CONTROL_REFUSAL, DashboardSession
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.interfaces.robot_api_server import RobotApiSession
from rig.world.ur10e.interfaces.rtde import RtdeSession, build_package
from rig.world.ur10e.modes import RuntimeState
from rig.world.ur10e.robot import Robot
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal
from support.laboratories.worlds import World, WorldHandle
from support.paths import DEMO
from support.processes.waiting import wait_for

PROGRAM = b"def wait():\n  sleep(60)\nend\n"
X, CB3 = ("world.arm.polyscope=10.14.0.0",), ("arm.model=ur10_cb3",)


def plays(robot: Robot) -> bool:
    """Whether a program runs on it."""
    return robot.runtime_state == RuntimeState.PLAYING


def playing(overrides: tuple[str, ...] = ()) -> Robot:
    """A controller that plays a program, on its pendant's word in remote control."""
    loaded = ideal(DEMO, list(overrides))
    robot = Laboratory(loaded.config, read_world_section(loaded)).robot
    PrimarySession(robot).receive(PROGRAM)
    for _ in range(TICKS_PER_SECOND // 10):
        robot.step()
    assert plays(robot)
    return robot


ORDERS = (
    "stop", "play", "pause", "power off", "power on", "brake release", "unlock protective stop", "restart safety",
    "shutdown", "load wait_program.urp", "load installation default.installation",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("order", ORDERS)
def test_the_dashboard_refuses_every_order_and_answers_questions(order: str) -> None:
    robot = playing()
    dashboard = DashboardSession(robot)
    robot.remote_control = False
    assert dashboard.answer(order) == REMOTE_CONTROL_REFUSAL
    assert plays(robot)
    assert dashboard.answer("is in remote control") == "false"
    assert dashboard.answer("running") == "Program running: true"


def test_a_connection_that_was_opened_in_local_control_stays_so() -> None:
    robot = playing()
    robot.remote_control = False
    dashboard, primary = DashboardSession(robot), PrimarySession(robot)
    robot.remote_control = True
    assert dashboard.answer("stop") == REMOTE_CONTROL_REFUSAL
    primary.receive(b"stop program\n")
    assert robot.messages.after(0)[-1].error == READ_ONLY and plays(robot)
    assert DashboardSession(robot).answer("stop") == "Stopped"


def test_a_cb3_does_not_know_local_control() -> None:
    robot = playing(CB3)
    robot.remote_control = False
    assert DashboardSession(robot).answer("is in remote control").startswith("could not understand")
    assert DashboardSession(robot).answer("stop") == "Stopped"


def asked(robot: Robot, method: str, path: str, body: str = "") -> tuple[int, dict[str, str]]:
    """Status and body of one exchange, whose request comes in two pieces."""
    session = RobotApiSession(robot)
    head = f"{method} /universal-robots/robot-api{path} HTTP/1.1\r\nContent-Length: {len(body)}\r\n\r\n"
    answer = session.receive(head.encode()) + session.receive(body.encode())
    lines, _, content = answer.partition(b"\r\n\r\n")
    return int(lines.split()[1]), json.loads(content)


def test_the_robot_api_forbids_orders_about_programs() -> None:
    robot = playing(X)
    state = "/program/v1/state"
    assert asked(robot, "GET", state) == (200, {"state": "PLAYING"})
    robot.remote_control = False
    assert asked(robot, "PUT", state, '{"action": "stop"}')[0] == 403
    assert asked(robot, "GET", "/system/v1/controlmode") == (200, {"mode": "LOCAL"})
    assert plays(robot)
    robot.remote_control = True
    assert asked(robot, "PUT", state, "{}")[0] == 400
    assert asked(robot, "PUT", state, '{"action": "stop"}')[0] == 200
    assert not plays(robot)


def test_registers_are_taken_in_local_control_too() -> None:
    """Over them the client stops its script when nobody else may."""
    robot = playing()
    robot.remote_control = False
    session = RtdeSession(robot)
    session.receive(build_package("V", b"\0\2"))
    assert session.receive(build_package("I", b"input_int_register_0")) == build_package("I", b"\1INT32")
    session.receive(build_package("U", b"\1\0\0\0\7"))
    assert robot.inputs.ints[0] == 7


@pytest.mark.slow
def test_connections_that_take_scripts_are_closed_when_it_begins(world: World) -> None:
    running = world()
    with closing(socket.create_connection((running.host, 30001))) as primary:
        primary.sendall(PROGRAM)
        wait_for(lambda: running.state()["program_running"], "the program")
        running.control({"do": "remote_control", "on": False})
        primary.settimeout(10.0)
        while primary.recv(65536):
            pass
    assert running.state()["program_running"], "the program goes on"


def said_since(running: WorldHandle, before: int) -> bool:
    """Whether the controller has told its program's name twice since then."""
    messages: list[str] = running.state()["messages"]
    return messages.count("wait") == before + 2


@pytest.mark.slow
def test_a_stop_can_be_tied_to_the_start_of_every_program(world: World) -> None:
    running = world()
    running.control({"do": "at_program_start", "then": {"do": "stop_program"}, "after_s": 0.1})
    with closing(socket.create_connection((running.host, 30001))) as primary:
        for _ in range(2):
            before = running.state()["messages"].count("wait")
            primary.sendall(PROGRAM)
            wait_for(partial(said_since, running, before), "its start and its end, each with its name")
    assert not running.state()["program_running"]
