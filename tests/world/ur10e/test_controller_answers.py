"""What the simulated controller answers where clients were answered wrongly: dashboard, scripts, primary messages."""

import struct

import pytest
from scipy.spatial.transform import Rotation

from rig.config.load import load
from rig.world.clock import TICKS_PER_SECOND
from rig.world.laboratory import Laboratory
from rig.world.ur10e.controller_messages import MessageKind, ProgramError
from rig.world.ur10e.interfaces.dashboard_server import DashboardSession
from rig.world.ur10e.interfaces.primary_server import ROBOT_MESSAGE, PrimarySession
from rig.world.ur10e.modes import RobotMode, RuntimeState, SafetyMode
from rig.world.ur10e.motion.forward_kinematics import flange_pose
from rig.world.ur10e.programs.ur_rtde_questions import build_questions
from rig.world.ur10e.programs.ur_rtde_registers import ProgramRegisters
from rig.world.ur10e.programs.urscript import parse_arguments
from rig.world.ur10e.robot import Robot
from rig.world.world_section import read_world_section
from support.paths import DEMO

LOADED = load(DEMO)


@pytest.fixture
def robot() -> Robot:
    here = Laboratory(LOADED.config, read_world_section(LOADED))
    here.unplug()
    return here.robot


def test_the_dashboard_keeps_the_operational_mode_that_it_is_given(robot: Robot) -> None:
    dashboard = DashboardSession(robot)
    assert dashboard.answer("get operational mode") == "NONE"
    assert dashboard.answer("set operational mode manual") == "Operational mode 'MANUAL' is set"
    assert dashboard.answer("get operational mode") == "MANUAL"
    assert dashboard.answer("set operational mode foo") == "Failed setting operational mode: 'foo'"
    assert dashboard.answer("get operational mode") == "MANUAL"
    assert dashboard.answer("clear operational mode").endswith("Current operational mode: 'NONE'.")
    assert dashboard.answer("get operational mode") == "NONE"


def test_the_dashboard_saves_its_log_and_loads_no_installation_without_a_name(robot: Robot) -> None:
    dashboard = DashboardSession(robot)
    assert dashboard.answer("saveLog") == "Log saved to disk"
    assert dashboard.answer("load installation").startswith("File not found")
    assert dashboard.answer("load installation default.installation") == "Loading installation: default.installation"


def test_arguments_may_be_expressions_of_constants() -> None:
    """As the client's own script functions have them."""
    said = parse_arguments("write_output_integer_register(0 + 0, 2 * (3 - 1))")
    assert said == {"0": 0, "1": 4}
    assert parse_arguments("movej([1/2, -0.5 - 1, 0, 0, 0, 0], a=2*1.5)") == {"0": [0.5, -1.5, 0, 0, 0, 0], "a": 3.0}
    for wrong in ("sleep(x + 1)", "sleep(1/0)", "sleep('a' * 999999999)", "sleep(2 ** 9)"):
        with pytest.raises(ProgramError, match="not simulated"):
            parse_arguments(wrong)


def test_the_forward_kinematics_of_given_joints(robot: Robot) -> None:
    """By its command alone: version 1.6.5 of the client hangs before it sends it."""
    q, offset = (0.2, -1.4, 1.5, -1.3, -1.2, 0.3), (0.01, 0.02, 0.1, 0.0, 0.3, 0.0)
    robot.inputs.doubles[24:36] = [*q, *offset]
    build_questions(robot, ProgramRegisters(robot, 24))[44]()
    flange = flange_pose(q, robot.links)
    turned = Rotation.from_rotvec(flange[3:])
    assert robot.outputs.doubles[24:27] == pytest.approx(flange[:3] + turned.apply(offset[:3]), abs=1e-12)
    assert robot.outputs.doubles[27:30] == pytest.approx(
        (turned * Rotation.from_rotvec(offset[3:])).as_rotvec(), abs=1e-12
    )


def told(session: PrimarySession, kind: MessageKind) -> list[bytes]:
    """The robot messages of a kind that a client of the primary interface gets now: what comes after their header."""
    data = session.tick()
    contents = []
    while data:
        size, package = struct.unpack_from(">iB", data)
        if package == ROBOT_MESSAGE and data[14] == kind:
            contents.append(data[15:size])
        data = data[size:]
    return contents


def errors(session: PrimarySession) -> list[tuple[int, ...]]:
    """Code, argument and level of the errors, as the maker's fake_primary_server.cpp lays them out."""
    return [struct.unpack_from(">iii", content) for content in told(session, MessageKind.ERROR_CODE)]


def exceptions(session: PrimarySession) -> list[tuple[int, int, str]]:
    """Line, column and text of what is wrong with a program."""
    return [
        (*struct.unpack_from(">ii", content), content[8:].decode()) for content in told(session, MessageKind.EXCEPTION)
    ]


def ticks(robot: Robot, time_s: float) -> None:
    for _ in range(round(time_s * TICKS_PER_SECOND)):
        robot.step()


@pytest.mark.slow
def test_a_change_of_the_safety_mode_is_told_at_the_primary_interface(robot: Robot) -> None:
    session = PrimarySession(robot)
    robot.protective_stop()
    robot.step()
    assert [content[8] for content in told(session, MessageKind.SAFETY_MODE)] == [SafetyMode.PROTECTIVE_STOP]


def test_errors_are_told_by_their_codes_at_the_primary_interface(robot: Robot) -> None:
    """Those of the maker's table that this robot can come to: the mode changed, stopped for a test, read-only."""
    session = PrimarySession(robot)
    robot.power_off()
    robot.power_on()
    ticks(robot, 1.0)
    robot.brake_release()
    ticks(robot, 1.0)
    assert errors(session) == [(100, mode, 1) for mode in (3, 4, 5, 7)]
    session.receive(b"protective_stop()\n")
    ticks(robot, 0.1)
    assert errors(session) == [(209, 0, 3)]
    robot.remote_control = False
    session.receive(b"set unlock protective stop\n")
    assert errors(session) == [(210, 0, 2)] and robot.safety_mode == SafetyMode.PROTECTIVE_STOP


def test_a_line_out_of_reach_ends_in_a_protective_stop(robot: Robot) -> None:
    session = PrimarySession(robot)
    session.receive(b"movel(p[0,0,0,0,0,0])\n")
    ticks(robot, 0.5)
    assert robot.safety_mode == SafetyMode.PROTECTIVE_STOP and robot.runtime_state == RuntimeState.STOPPED
    assert [code for code, _, _ in errors(session)] == [204]


def test_the_pendant_waits_with_an_unlock_and_the_primary_interface_does_not(robot: Robot) -> None:
    robot.protective_stop()
    assert DashboardSession(robot).answer("unlock protective stop").startswith("Cannot unlock")
    PrimarySession(robot).receive(b"set unlock protective stop\n")
    ticks(robot, 1.0)
    assert robot.safety_mode == SafetyMode.NORMAL
    robot.protective_stop()
    ticks(robot, 5.0)
    assert DashboardSession(robot).answer("unlock protective stop") == "Protective stop releasing"


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("def illegal():\n  calldoesntexist()\nend", (2, 3, "compile_error_name_not_found:calldoesntexist:")),
        ("def open():\n    textmsg('(', (1)\nend", (3, 1, "syntax_error_on_line:3:end:")),
        ("def shut():\n    sync())\nend", (2, 1, "syntax_error_on_line:2:    sync()):")),
    ],
)
def test_a_program_that_does_not_compile_is_told_in_the_words_of_the_compiler(
    robot: Robot, program: str, said: tuple[int, int, str]
) -> None:
    """The maker's test_primary_client.cpp has the first, notes of others who sent such programs the second."""
    session = PrimarySession(robot)
    session.receive(program.encode() + b"\n")
    ticks(robot, 0.1)
    assert robot.runtime_state == RuntimeState.STOPPED
    assert exceptions(session) == [said]


def test_a_program_that_comes_before_the_brakes_are_released_stands_paused(robot: Robot) -> None:
    session, dashboard = PrimarySession(robot), DashboardSession(robot)
    program = b"def wait():\n  sleep(60)\nend\n"
    robot.power_off()
    session.receive(program)
    ticks(robot, 0.1)
    assert dashboard.answer("programState") == "PAUSED wait"
    assert dashboard.answer("play") == "Failed to execute: play"
    robot.brake_release()
    ticks(robot, 2.0)
    assert robot.robot_mode == RobotMode.RUNNING
    assert dashboard.answer("programState") == "PAUSED wait"
    session.receive(program)
    ticks(robot, 0.1)
    assert dashboard.answer("programState").startswith("STOPPED")
    session.receive(program)
    ticks(robot, 0.1)
    assert dashboard.answer("programState") == "PLAYING wait"


def test_a_paused_program_can_be_played_once_the_brakes_are_released(robot: Robot) -> None:
    robot.power_off()
    PrimarySession(robot).receive(b"def wait():\n  sleep(60)\nend\n")
    robot.brake_release()
    ticks(robot, 2.0)
    assert DashboardSession(robot).answer("play") == "Starting program"
    robot.step()
    assert DashboardSession(robot).answer("programState") == "PLAYING wait"
