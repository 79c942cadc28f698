"""The simulated controller, driven by clients that do not know it is simulated."""

import math
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol, TypeVar

import numpy as np
import pytest
from rtde_control import Path, PathEntry, RTDEControlInterface
from rtde_io import RTDEIOInterface
from rtde_receive import RTDEReceiveInterface
from scipy.spatial.transform import Rotation
from third_party.rtde import rtde as makers

from rig.world.ur10e.motion.forward_kinematics import flange_pose
from support.laboratories.worlds import World, WorldHandle, worlds
from support.processes.waiting import PATIENCE_S, wait_for
from support.wires.arm_client import client

pytestmark = pytest.mark.slow

HOME = [0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0]
ENCODER_RAD = 1.5e-4  # six times the encoders' noise


class Client(Protocol):
    """What the maker's three interfaces have in common."""

    def disconnect(self) -> None: ...


C = TypeVar("C", bound=Client)


@contextmanager
def disconnecting(interface: C) -> Iterator[C]:
    try:
        yield interface
    finally:
        interface.disconnect()


def control_of(world: WorldHandle) -> AbstractContextManager[RTDEControlInterface]:
    return disconnecting(RTDEControlInterface(world.host))


def reports_of(world: WorldHandle, rate_hz: float = 500.0) -> AbstractContextManager[RTDEReceiveInterface]:
    return disconnecting(RTDEReceiveInterface(world.host, rate_hz))


def outputs_of(world: WorldHandle) -> AbstractContextManager[RTDEIOInterface]:
    return disconnecting(RTDEIOInterface(world.host))


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
def test_with_a_turned_tool_frame_poses_are_the_tools(world: World) -> None:
    running = world({"world": {"arm": {"tcp_rotation_deg": [0.0, 0.0, 90.0]}}})
    with control_of(running) as control, reports_of(running) as receive:
        tilted = [0.0, -1.5, 1.5, -1.5, -1.2, 0.3]
        assert control.moveJ(tilted, 2.0, 10.0)
        wait_for(lambda: receive.getActualQ() == pytest.approx(tilted, abs=1e-4), "the start")
        offset = [0.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2]
        assert control.getTCPOffset() == pytest.approx(offset)
        tool, flange = receive.getActualTCPPose(), list(flange_pose(tilted))
        # This client does not wait for the answer to that question.
        wait_for(lambda: control.getActualToolFlangePose() == pytest.approx(flange, abs=1e-4), "the flange's pose")
        turned = Rotation.from_rotvec(flange[3:]) * Rotation.from_rotvec(offset[3:])
        assert tool == pytest.approx([*flange[:3], *turned.as_rotvec()], abs=1e-4)
        assert control.getForwardKinematics() == pytest.approx(tool, abs=1e-4)
        assert control.getInverseKinematics(tool) == pytest.approx(tilted, abs=1e-4)
        up = [*tool[:2], tool[2] + 0.1, *tool[3:]]
        assert control.moveL(up, 0.25, 0.5)
        wait_for(lambda: receive.getActualTCPPose() == pytest.approx(up, abs=1e-4), "the pose")


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


def test_a_command_that_is_not_acted_out_is_named(world: World) -> None:
    running = world()
    named = "not simulated: command 52 (freedriveMode) of rtde_control"
    with client(running, "say(control.freedriveMode())"):
        wait_for(lambda: named in running.state()["messages"], "the name of the command")
        assert not running.state()["program_running"]


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


def test_time_stamps_come_at_the_asked_rate(world: World) -> None:
    running = world({"world": {"time_scale": 1}})
    for rate_hz in (500, 125, 50):
        client = makers.RTDE(running.host, 30004)
        client.connect()
        assert client.send_output_setup(["timestamp"], ["DOUBLE"], frequency=rate_hz) and client.send_start()
        stamps = [client.receive().timestamp for _ in range(10)]
        client.disconnect()
        steps = [round((b - a) * rate_hz, 6) for a, b in pairwise(stamps)]
        assert min(steps) == 1 and all(step == round(step) for step in steps)  # this client drops what it is late for


def test_the_makers_client_reads_every_variable_and_writes_registers(world: World) -> None:
    connection = makers.RTDE(world().host, 30004)
    connection.connect()
    assert connection.get_controller_version() == (5, 14, 0, 0)
    names = [
        "timestamp",
        "actual_q",
        "joint_mode",
        "payload_cog",
        "actual_digital_output_bits",
        "output_bit_register_64",
    ]
    names += ["input_int_register_24", "input_double_register_24", "tool_output_mode", "input_bit_registers0_to_31"]
    assert connection.send_output_setup(names, frequency=125)
    inputs = connection.send_input_setup(
        ["input_int_register_24", "input_double_register_24", "input_bit_registers0_to_31"]
    )
    assert connection.send_start()
    inputs.input_int_register_24, inputs.input_double_register_24 = -5, 0.25
    inputs.input_bit_registers0_to_31 = 0b1010
    connection.send(inputs)
    state = wait_for(lambda: (s := connection.receive()) and s.input_int_register_24 == -5 and s, "the register")
    assert state.input_double_register_24 == 0.25 and state.input_bit_registers0_to_31 == 0b1010
    assert state.actual_q == pytest.approx(HOME, abs=ENCODER_RAD) and len(state.joint_mode) == 6
    assert connection.send_pause()
    with pytest.raises(ValueError, match="NOT_FOUND"):
        connection.send_output_setup(["no_such_variable"])
    connection.disconnect()


def test_version_1_of_the_protocol(world: World) -> None:
    """Version 1 has no frequency and no recipe id in what the controller sends."""
    with socket.create_connection((world().host, 30004), 5.0) as client, client.makefile("rb") as answers:

        def ask(kind: bytes, payload: bytes) -> bytes:
            client.sendall(struct.pack(">HB", 3 + len(payload), kind[0]) + payload)
            size, _ = struct.unpack(">HB", answers.read(3))
            return answers.read(size - 3)

        assert ask(b"V", struct.pack(">H", 1)) == b"\1"
        assert ask(b"O", b"timestamp,robot_mode") == b"DOUBLE,INT32"
        assert ask(b"S", b"") == b"\1"
        size, kind, stamp, mode = struct.unpack(">HBdi", answers.read(15))
        assert (size, kind, mode) == (15, ord("U"), 7) and stamp > 0.0
        client.sendall(struct.pack(">HBH", 5, ord("V"), 9))  # an unknown version is declined, not fatal


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


def test_a_program_sent_as_text_is_played(world: World) -> None:
    running = world()
    program = (
        "def nudge():\n"
        '  textmsg("moving")  # a remark\n'
        "  set_payload(1.5, [0.0, 0.0, 0.05])\n"
        "  movej([0.2, -1.5708, 1.5708, -1.5708, -1.5708, 0.0], a=4.0, v=1.0)\n"
        "  sleep(0.1)\n"
        "  write_output_integer_register(24, 7)\n"
        "end\n"
    )
    with reports_of(running) as receive, socket.create_connection((running.host, 30003), PATIENCE_S) as script:
        for part in (program[:30], program[30:]):
            script.sendall(part.encode())
        wait_for(lambda: receive.getActualQ()[0] > 0.19, "the move")
        wait_for(lambda: not running.state()["program_running"], "the program's end")
        state = running.state()
        assert state["payload_kg"] == 1.5 and "moving" in state["messages"]
        script.sendall(b"set_standard_digital_out(2, True)\n")
        wait_for(lambda: receive.getDigitalOutState(2), "the statement outside a program")


def test_a_statement_the_simulation_does_not_know_is_named(world: World) -> None:
    running = world()
    with socket.create_connection((running.host, 30002), PATIENCE_S) as script:
        script.sendall(b"def odd():\n  turn = 1\nend\n")
        wait_for(lambda: any("not simulated: turn = 1" in text for text in running.state()["messages"]), "the message")


class Dashboard:
    """A plain dashboard client."""

    def __init__(self, world: WorldHandle) -> None:
        self._socket = socket.create_connection((world.host, 29999), PATIENCE_S)
        self._lines = self._socket.makefile("r")
        self.greeting = self._lines.readline().strip()

    def __call__(self, command: str) -> str:
        self._socket.sendall(command.encode() + b"\n")
        return self._lines.readline().strip()

    def __enter__(self) -> "Dashboard":
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()
        self._socket.close()


def test_the_dashboard_answers_in_the_makers_words(world: World) -> None:
    running = world()
    with Dashboard(running) as ask:
        assert ask.greeting == "Connected: Universal Robots Dashboard Server"
        assert ask("PolyscopeVersion").startswith("URSoftware 5.14.0.0 (")
        assert ask("get serial number") == "20265500123"
        assert ask("get robot model").startswith("UR10")
        assert ask("is in remote control") == "true"
        assert ask("robotmode") == "Robotmode: RUNNING"
        assert ask("safetystatus") == "Safetystatus: NORMAL" and ask("safetymode") == "Safetymode: NORMAL"
        assert ask("running") == "Program running: false" and ask("programState").startswith("STOPPED ")
        assert ask("load nothing.urp") == "File not found: nothing.urp"
        assert ask("play") == "Failed to execute: play"
        assert ask("load wait_program.urp") == "Loading program: wait_program.urp"
        assert ask("play") == "Starting program"
        wait_for(lambda: ask("programState") == "PLAYING wait_program.urp", "the program to play")
        assert ask("pause") == "Pausing program"
        wait_for(lambda: ask("programState") == "PAUSED wait_program.urp", "the pause")
        assert ask("play") == "Starting program"
        wait_for(lambda: ask("running") == "Program running: true", "the program to go on")
        assert ask("stop") == "Stopped" and ask("stop") == "Stopped"
        assert ask("power off") == "Powering off" and ask("robotmode") == "Robotmode: POWER_OFF"
        assert ask("power on") == "Powering on"
        wait_for(lambda: ask("robotmode") == "Robotmode: IDLE", "power")
        assert ask("brake release") == "Brake releasing"
        wait_for(lambda: ask("robotmode") == "Robotmode: RUNNING", "the brakes")
        assert ask("addToLog hello") == "Added log message" and ask("close popup") == "closing popup"
        assert ask("nonsense").startswith("could not understand")
        assert ask("quit") == "Disconnected"


@pytest.mark.one_in(2)
@pytest.mark.parametrize("polyscope", ["5.6.0.0", "5.23.1.0"])
def test_the_controller_takes_other_polyscope_versions(world: World, polyscope: str) -> None:
    with client(world({"world": {"arm": {"polyscope": polyscope}}}), "say(control.moveJ([*home[:5], 0.1]))") as arm:
        arm.says("True")


def test_the_upper_range_of_registers(world: World) -> None:
    script = """
        control = RTDEControlInterface(host, -1.0, RTDEControlInterface.FLAG_UPLOAD_SCRIPT
                                       | RTDEControlInterface.FLAG_UPPER_RANGE_REGISTERS)
        say(control.moveJ([*home[:5], 0.1]))
    """
    with client(world(), script, connect=False) as arm:
        arm.says("True")


def test_connecting_takes_over_from_the_program_a_dead_client_left_running(world: World) -> None:
    running = world()
    with client(running, "control.moveJ(there, 0.5, 4.0, True); say('moving'); time.sleep(60)") as arm:
        arm.says("moving")
    assert running.state()["program"] == "rtde_control" and running.state()["program_running"]
    with client(running, "say(control.moveJ([*home[:5], 0.1])); say(control.reuploadScript())") as arm:
        arm.says("True")
        arm.says("True")


class Primary:
    """A client of the primary interface, written from the maker's description of it."""

    def __init__(self, world: WorldHandle, port: int = 30001) -> None:
        self._socket = socket.create_connection((world.host, port), PATIENCE_S)
        self._stream = self._socket.makefile("rb")
        self.parts: dict[int, bytes] = {}  # the newest sub-package of each kind
        self.messages: list[tuple[int, bytes]] = []

    def read(self) -> None:
        """Take in one package."""
        size, kind = struct.unpack(">iB", self._stream.read(5))
        payload = self._stream.read(size - 5)
        if kind == 20:
            self.messages.append((payload[9], payload[10:]))
            return
        assert kind == 16
        while payload:
            size, part = struct.unpack_from(">iB", payload)
            self.parts[part], payload = payload[5:size], payload[size:]

    def until(self, condition: Callable[[], Any]) -> None:
        for _ in range(2000):
            if condition():
                return
            self.read()
        raise AssertionError("not seen in 2000 packages")

    def send(self, text: str) -> None:
        self._socket.sendall(text.encode() + b"\n")

    @property
    def robot_mode(self) -> int:
        return self.parts[0][15]

    @property
    def flags(self) -> tuple[bool, ...]:
        """Connected, enabled, powered, emergency stopped, protective stopped, program running, program paused."""
        return struct.unpack(">7?", self.parts[0][8:15])

    def __enter__(self) -> "Primary":
        self.until(lambda: self.parts)
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()
        self._socket.close()


def test_the_primary_interface_shows_the_state_and_the_messages_of_a_program(world: World) -> None:
    with Primary(world()) as client:
        assert client.messages[0][0] == 3 and b"URControl" in client.messages[0][1]
        assert [len(client.parts[kind]) for kind in (0, 1, 3, 4, 5, 6)] == [42, 246, 70, 96, 220, 440]
        assert struct.unpack(">d", client.parts[1][41 * 4 : 41 * 4 + 8])[0] == pytest.approx(HOME[4], abs=ENCODER_RAD)
        assert client.robot_mode == 7 and client.flags == (True, True, True, False, False, False, False)
        client.messages.clear()
        client.send('def test_fun():\n  textmsg("still running")\n  sleep(0.1)\n  sync()\nend')
        client.until(lambda: len(client.messages) == 3)
        started, said, stopped = client.messages
        assert started == (7, struct.pack(">iiB", 0, 0, 19) + b"PROGRAM_XXX_STARTED" + b"test_fun")
        assert said == (0, b"still running")
        assert stopped[0] == 7 and stopped[1].endswith(b"PROGRAM_XXX_STOPPED" + b"test_fun")
        client.send("def odd():\n  calldoesntexist()\nend")
        client.until(lambda: client.messages[-1][0] == 10)
        assert struct.unpack(">ii", client.messages[-1][1][:8]) == (2, 3)  # line and column
        assert b"calldoesntexist" in client.messages[-1][1]


def test_orders_over_the_secondary_interface(world: World) -> None:
    with Primary(world(), 30002) as client:
        client.send("def forever():\n  while True:\n    sleep(1.0)\n    sync()\n  end\nend")
        client.until(lambda: client.flags[5])
        client.send("stop program")
        client.until(lambda: not client.flags[5])
        client.send("power off")
        client.until(lambda: client.robot_mode == 3)
        client.send("power on")
        client.until(lambda: client.robot_mode == 5)
        client.send("def early():\n  sleep(60)\nend")
        client.until(lambda: client.flags[6] and not client.flags[5])
        client.send("set robotmode run")
        client.until(lambda: client.robot_mode == 7)
        assert client.flags[6]
        client.send("protective_stop()")  # comes while a program is paused, and only stops that
        client.until(lambda: not client.flags[6])
        assert not client.flags[4]
        client.send("protective_stop()")
        client.until(lambda: client.flags[4])
        client.send("set unlock protective stop")
        client.until(lambda: not client.flags[4])
