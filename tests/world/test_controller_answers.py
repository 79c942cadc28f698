"""What the simulated controller answers where clients were answered wrongly: dashboard, scripts, primary messages."""

import struct

import pytest
from scipy.spatial.transform import Rotation

from rig.config.load import load
from rig.world.laboratory import Laboratory
from rig.world.section import world_section
from rig.world.ur10e.controller_messages import MessageKind, ProgramError
from rig.world.ur10e.dashboard_server import DashboardSession
from rig.world.ur10e.forward_kinematics import flange_pose
from rig.world.ur10e.modes import SafetyMode
from rig.world.ur10e.primary import ROBOT_MESSAGE, PrimarySession
from rig.world.ur10e.robot import Robot
from rig.world.ur10e.ur_rtde_questions import questions
from rig.world.ur10e.ur_rtde_registers import Registers
from rig.world.ur10e.urscript import arguments
from support.paths import DEMO

LOADED = load(DEMO)


@pytest.fixture
def robot() -> Robot:
    here = Laboratory(LOADED.config, world_section(LOADED))
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
    said = arguments("write_output_integer_register(0 + 0, 2 * (3 - 1))")
    assert said == {"0": 0, "1": 4}
    assert arguments("movej([1/2, -0.5 - 1, 0, 0, 0, 0], a=2*1.5)") == {"0": [0.5, -1.5, 0, 0, 0, 0], "a": 3.0}
    for wrong in ("sleep(x + 1)", "sleep(1/0)", "sleep('a' * 999999999)", "sleep(2 ** 9)"):
        with pytest.raises(ProgramError, match="not simulated"):
            arguments(wrong)


def test_the_forward_kinematics_of_given_joints(robot: Robot) -> None:
    """By its command alone: version 1.6.5 of the client hangs before it sends it."""
    q, offset = (0.2, -1.4, 1.5, -1.3, -1.2, 0.3), (0.01, 0.02, 0.1, 0.0, 0.3, 0.0)
    robot.inputs.doubles[24:36] = [*q, *offset]
    questions(robot, Registers(robot, 24))[44]()
    flange = flange_pose(q, robot.links)
    turned = Rotation.from_rotvec(flange[3:])
    assert robot.outputs.doubles[24:27] == pytest.approx(flange[:3] + turned.apply(offset[:3]), abs=1e-12)
    assert robot.outputs.doubles[27:30] == pytest.approx(
        (turned * Rotation.from_rotvec(offset[3:])).as_rotvec(), abs=1e-12
    )


def test_a_change_of_the_safety_mode_is_told_at_the_primary_interface(robot: Robot) -> None:
    session = PrimarySession(robot)
    robot.protective_stop()
    robot.step()
    told, modes = session.tick(), []
    while told:
        size, kind = struct.unpack_from(">iB", told)
        if kind == ROBOT_MESSAGE and told[14] == MessageKind.SAFETY_MODE:
            modes.append(told[23])
        told = told[size:]
    assert modes == [SafetyMode.PROTECTIVE_STOP]


def test_an_unlock_that_comes_too_early_is_refused_in_words(robot: Robot) -> None:
    robot.protective_stop()
    PrimarySession(robot).receive(b"set unlock protective stop\n")
    assert robot.safety_mode == SafetyMode.PROTECTIVE_STOP
    assert any("until 5s after" in message.text for message in robot.messages.after(0))
