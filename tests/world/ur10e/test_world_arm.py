"""Moves of the simulated arm, by clients that do not know it is simulated: one arm for all of them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from rtde_control import Path, PathEntry, RTDEControlInterface
from rtde_receive import RTDEReceiveInterface
from scipy.spatial.transform import Rotation

from rig.world.ur10e.motion.forward_kinematics import flange_pose
from support.laboratories.worlds import WorldHandle, worlds
from support.processes.waiting import wait_for
from support.wires.arm_interfaces import ENCODER_RAD, HOME, control_of, outputs_of, reports_of

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Arm:
    """A world with the unmodified client connected to it."""

    world: WorldHandle
    control: RTDEControlInterface
    receive: RTDEReceiveInterface


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arm]:
    """One arm for all tests that leave it as they found it: connecting and disconnecting takes seconds."""
    with worlds(tmp_path_factory.mktemp("arm")) as start:
        running = start()
        with control_of(running) as control, reports_of(running) as receive:
            yield Arm(running, control, receive)


@pytest.fixture
def home(arm: Arm) -> Arm:
    """The arm at its home pose."""
    assert arm.control.moveJ(HOME, 3.0, 10.0)
    return arm


def target(wrist_3: float) -> list[float]:
    return [*HOME[:5], wrist_3]


@pytest.mark.thorough
def test_a_blocking_move_arrives_in_its_planned_time(home: Arm) -> None:
    control, receive = home.control, home.receive
    start = receive.getTimestamp()
    assert control.moveJ(target(math.pi), math.radians(60), math.radians(80))
    took = receive.getTimestamp() - start
    wait_for(lambda: receive.getActualQ() == pytest.approx(target(math.pi), abs=ENCODER_RAD), "the target")
    assert (
        3.75 - 0.01 <= took <= 3.75 + 0.5
    )  # the client may show a state of before; the handshake costs wall time, ten times as much in virtual time


def test_an_asynchronous_move_shows_its_progress_and_its_end(home: Arm) -> None:
    control, receive = home.control, home.receive
    assert control.moveJ(target(1.0), 1.05, 1.4, True)
    wait_for(lambda: control.getAsyncOperationProgress() >= 0, "the move to be under way")
    operation = control.getAsyncOperationProgressEx().operationId()
    wait_for(lambda: control.getAsyncOperationProgress() < 0, "the move to end")
    wait_for(lambda: receive.getActualQ() == pytest.approx(target(1.0), abs=ENCODER_RAD), "the target")
    assert control.moveJ(target(0.9), 1.05, 1.4, True)
    wait_for(lambda: control.getAsyncOperationProgressEx().operationId() != operation, "the next operation")
    wait_for(lambda: control.getAsyncOperationProgress() < 0, "the move to end")


def test_a_path_of_moves_visits_every_point(home: Arm) -> None:
    control, receive = home.control, home.receive
    seen: list[float] = []

    def angle() -> float:
        seen.append(receive.getActualQ()[5])
        return seen[-1]

    assert control.moveJ([[*target(0.4), 1.0, 4.0, 0.0], [*target(-0.4), 1.0, 4.0, 0.0]], True)
    wait_for(lambda: angle() < -0.39, "the second point")
    wait_for(lambda: control.getAsyncOperationProgress() < 0, "the path to end")
    assert max(seen) == pytest.approx(0.4, abs=0.02)
    wait_for(lambda: receive.getActualQ() == pytest.approx(target(-0.4), abs=ENCODER_RAD), "the last point")


def test_stop_speed_and_servo_commands(home: Arm) -> None:
    control, receive = home.control, home.receive
    assert control.moveJ(target(5.0), 1.0, 4.0, True)
    wait_for(lambda: receive.getActualQd()[5] > 0.8, "the cruise")
    control.stopJ(4.0)
    assert not home.world.state()["moving"] and 0.1 < receive.getActualQ()[5] < 4.9
    control.speedJ([0.0, 0.0, 0.0, 0.0, 0.0, -0.5], 2.0)
    wait_for(lambda: receive.getActualQd()[5] < -0.4, "the asked speed")
    control.speedStop(10.0)
    wait_for(lambda: not home.world.state()["moving"], "the joints to rest")
    goal = [*HOME[:5], receive.getActualQ()[5] + 0.1]
    control.servoJ(goal, 0.0, 0.0, 0.002, 0.1, 300)
    wait_for(lambda: abs(receive.getTargetQ()[5] - goal[5]) < 1e-3, "the servo target")
    control.servoStop()


@pytest.mark.thorough
def test_moves_in_tool_space_as_ur_rtdes_own_tests_make_them(home: Arm) -> None:
    control, receive = home.control, home.receive
    tilted = [0.0, -1.5, 1.5, -1.5, -1.2, 0.3]  # at home the flange stands half a turn off, where signs are free
    assert control.moveJ(tilted, 2.0, 10.0)
    wait_for(lambda: receive.getActualQ() == pytest.approx(tilted, abs=1e-4), "the start")
    start = receive.getActualTCPPose()
    assert control.moveL(start, 3, 3)  # already there
    up = [*start[:2], start[2] + 0.1, *start[3:]]
    assert control.moveL(up, 0.25, 0.5)
    wait_for(lambda: receive.getActualTCPPose() == pytest.approx(up, abs=1e-4), "the pose")
    assert control.getInverseKinematics(start) == pytest.approx(tilted, abs=1e-4)
    assert control.moveJ_IK(start, 1.0, 4.0)
    wait_for(lambda: receive.getActualQ() == pytest.approx(tilted, abs=1e-4), "the start")
    path = Path()
    path.addEntry(PathEntry(PathEntry.MoveJ, PathEntry.PositionTcpPose, [*up, 1.0, 4.0, 0.0]))
    path.addEntry(PathEntry(PathEntry.MoveL, PathEntry.PositionTcpPose, [*start, 0.5, 4.0, 0.099]))
    assert control.movePath(path, False)
    wait_for(lambda: receive.getActualTCPPose() == pytest.approx(start, abs=1e-4), "the end of the path")


@pytest.mark.thorough
def test_the_tool_is_steered_as_the_joints_are(home: Arm) -> None:
    control, receive = home.control, home.receive
    tilted = [0.0, -1.5, 1.5, -1.5, -1.2, 0.3]
    assert control.moveJ(tilted, 2.0, 10.0) and control.zeroFtSensor()
    wait_for(lambda: receive.getActualQ() == pytest.approx(tilted, abs=1e-4), "the start")
    start = receive.getActualTCPPose()
    assert control.speedL([0.0, 0.0, 0.1, 0.0, 0.0, 0.0], 1.0)
    wait_for(lambda: receive.getTargetTCPSpeed() == pytest.approx([0, 0, 0.1, 0, 0, 0], abs=1e-3), "the asked speed")
    assert control.speedStop(10.0)
    wait_for(lambda: not home.world.state()["moving"], "the joints to rest")
    risen = receive.getActualTCPPose()
    assert risen[2] > start[2] + 0.001 and risen[:2] == pytest.approx(start[:2], abs=1e-3)
    assert control.servoL(start, 0.0, 0.0, 0.002, 0.1, 300)
    wait_for(lambda: receive.getActualTCPPose() == pytest.approx(start, abs=1e-3), "the servo target")
    control.servoStop()


def test_kinematics_of_what_the_client_gives(home: Arm) -> None:
    control, offset = home.control, [0.01, 0.02, 0.1, 0.0, 0.3, 0.0]
    tilted = [0.2, -1.4, 1.5, -1.3, -1.2, 0.3]
    pose = list(flange_pose(tilted))
    placed, turned = control.poseTrans(pose, offset), Rotation.from_rotvec(pose[3:])
    assert placed[:3] == pytest.approx(np.array(pose[:3]) + turned.apply(offset[:3]), abs=1e-9)
    assert placed[3:] == pytest.approx((turned * Rotation.from_rotvec(offset[3:])).as_rotvec(), abs=1e-9)
    near = [angle + 0.1 for angle in tilted]
    assert control.getInverseKinematics(pose, near, 1e-10, 1e-10) == pytest.approx(tilted, abs=1e-6)
    assert control.isPoseWithinSafetyLimits(pose) and control.getInverseKinematicsHasSolution(pose)
    away = [3.0, *pose[1:]]
    assert not control.isPoseWithinSafetyLimits(away) and not control.getInverseKinematicsHasSolution(away)


def test_settings_and_questions(home: Arm) -> None:
    control, receive = home.control, home.receive
    assert control.setPayload(0.35, [0.0, 0.0, 0.025])
    wait_for(lambda: receive.getPayload() == 0.35, "the payload")
    wait_for(lambda: receive.getPayloadCog() == [0.0, 0.0, 0.025], "its centre")
    assert control.isJointsWithinSafetyLimits(HOME)
    assert not control.isJointsWithinSafetyLimits([7.0, *HOME[1:]])
    wait_for(control.isSteady, "half a second of standstill")
    assert receive.getRobotMode() == 7 and receive.getSafetyMode() == 1
    assert receive.getSpeedScaling() == 1.0 and receive.getTargetSpeedFraction() == 1.0
    pose = receive.getActualTCPPose()
    assert abs(pose[3]) + abs(pose[4]) == pytest.approx(math.pi, rel=0.5)  # at home the flange points down


@pytest.mark.thorough
def test_the_speed_slider_slows_a_move_and_shows(home: Arm) -> None:
    control, receive = home.control, home.receive
    with outputs_of(home.world) as io:
        assert io.setSpeedSlider(0.5)
        assert io.setStandardDigitalOut(3, True) and io.setToolDigitalOut(1, True)
        wait_for(lambda: receive.getDigitalOutState(3) and receive.getDigitalOutState(17), "the outputs")
    wait_for(lambda: receive.getTargetSpeedFraction() == 0.5, "the slider")
    wait_for(lambda: home.world.state()["speed_scaling"] == pytest.approx(0.5), "the joints to follow")
    assert receive.getSpeedScaling() == 1.0  # what the slider leaves over: clients multiply both
    start = receive.getTimestamp()
    assert control.moveJ(target(1.0), 1.0, 2.0)
    # Of the client's two connections that of the states may be some packets behind the one that says the move is done.
    assert receive.getTimestamp() - start >= 2 * (1.0 + 0.5) - 0.1
    home.world.control({"do": "speed_slider", "fraction": 1.0})
