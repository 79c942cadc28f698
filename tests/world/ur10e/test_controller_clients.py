"""The simulated controller, driven by clients that do not know it is simulated."""

import math
import socket
import struct
from collections.abc import Callable
from itertools import islice, pairwise
from typing import Any

import pytest
from scipy.spatial.transform import Rotation
from third_party.rtde import rtde as makers

from rig.world.ur10e.motion.forward_kinematics import flange_pose
from support.laboratories.worlds import World, WorldHandle
from support.processes.waiting import PATIENCE_S, wait_for
from support.wires.arm_client import client
from support.wires.arm_interfaces import ENCODER_RAD, HOME, control_of, reports_of

pytestmark = pytest.mark.slow


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


def test_a_command_that_is_not_acted_out_is_named(world: World) -> None:
    running = world()
    named = "not simulated: command 52 (freedriveMode) of rtde_control"
    with client(running, "say(control.freedriveMode())"):
        wait_for(lambda: named in running.state()["messages"], "the name of the command")
        assert not running.state()["program_running"]


def test_time_stamps_come_at_the_asked_rate(world: World) -> None:
    running = world({"world": {"time_scale": 1}})
    for rate_hz in (500, 125, 50):
        client = makers.RTDE(running.host, 30004)
        client.connect()
        assert client.send_output_setup(["timestamp"], ["DOUBLE"], frequency=rate_hz) and client.send_start()
        states = (client.receive() for _ in range(1000))  # none after a second without data, as on a crowded computer
        stamps = [state.timestamp for state in islice(filter(None, states), 10)]
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
