"""Damaged messages to and from the arm's controller, and how their readers end.

A reader must read or refuse by name: any other exception reaches the caller of `carry_*`, with the bytes that caused
it. A reader that hangs is ended by an alarm.
"""

import socket
import struct
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from random import Random

from rig.turners.ur.controller import dashboard, primary_interface, rtde_packages, state_stream
from rig.world.laboratory import Laboratory
from rig.world.network import ClientSession
from rig.world.ur10e.interfaces.dashboard_server import DashboardSession
from rig.world.ur10e.interfaces.primary_server import CONFIGURATION, STATE, PrimarySession
from rig.world.ur10e.interfaces.primary_server import build_package as primary_package
from rig.world.ur10e.interfaces.rtde import RtdeSession
from rig.world.ur10e.interfaces.rtde import build_package as rtde_package
from rig.world.ur10e.modes import SafetyMode
from rig.world.ur10e.robot import Robot
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal
from support.paths import DEMO
from support.wires.damage import HANG_S, damage_message, ending_by_name

SESSION, RECOVERY = 3, 60  # messages after which the session is replaced, and the robot recovered
PATIENCE_S = 0.25  # that the rig's readers are given for a controller that is next door
HOSTS = tuple(f"127.19.{number}.1" for number in range(1, 9))  # so that there are ports enough for all connections


# -- the rig's side ----------------------------------------------------------------------------------------------------
_TYPES = ",".join(state_stream.VARIABLES.values()).encode()
_STATE = state_stream.PACKET.pack(1, 12.5, *range(6), *[0.1] * 6, 1.0, 1.0, 7, 1, 2, 3, 1, 0.35, 0.0, 0.0, 0.025)
_VERSION = struct.pack(">4I", 5, 14, 0, 0)
RTDE_ANSWERS = tuple(
    rtde_package(kind, payload)
    for kind, payload in (
        ("V", b"\1"),
        ("v", _VERSION),
        ("O", b"\1" + _TYPES),
        ("S", b"\1"),
        ("U", _STATE),
        ("M", b"\2hi\4RTDE\1"),
    )
)
DASHBOARD_ANSWERS = tuple(
    f"{line}\n".encode()
    for line in (
        "Connected: Universal Robots Dashboard Server", "Stopped", "Program running: true", "Program running: false",
        "true", "false", "URSoftware 5.14.0.0 (Jan 01 2024)", "20265500123", "could not understand: 'x'",
    )
)  # fmt: skip


class Controller:
    """A server that sends given parts to one client after the other, one for each question or all at once."""

    def __init__(self, port: int) -> None:
        self._listeners = [socket.create_server((host, port), backlog=4) for host in HOSTS]
        self._parts: Sequence[bytes] = ()
        self._asked = threading.Semaphore(0)
        self._turn = 0
        threading.Thread(target=self._serve, daemon=True).start()

    def next(self, parts: Sequence[bytes]) -> str:
        """Return the host to connect to for these parts."""
        self._parts = parts
        self._asked.release()
        return HOSTS[self._turn % len(HOSTS)]

    def done(self) -> None:
        """Note that a client has disconnected."""
        self._turn += 1

    def close(self) -> None:
        for listener in self._listeners:
            listener.close()

    def _serve(self) -> None:
        with suppress(OSError, ValueError):  # its listeners are closed in the end
            while True:
                self._asked.acquire()
                client, _ = self._listeners[self._turn % len(HOSTS)].accept()
                with client, suppress(OSError):
                    self._tell(client, self._parts)

    def _tell(self, client: socket.socket, parts: Sequence[bytes]) -> None:
        client.settimeout(0.005)
        for part in parts:
            if len(parts) > 1:
                with suppress(TimeoutError):  # a client that waits for the rest of an answer does not ask on
                    client.recv(4096)
            client.sendall(part)
        client.shutdown(socket.SHUT_WR)
        client.settimeout(HANG_S)
        while client.recv(65536):
            pass


def _read_states(host: str) -> str:
    with state_stream.StateStream(host, 125.0, PATIENCE_S) as stream:
        while not stream.closed:
            stream.read(PATIENCE_S)
    return "read"


def _ask_dashboard(host: str) -> str:
    with dashboard.Dashboard(host, PATIENCE_S) as client:
        assert isinstance(client.program_running(), bool)
        assert client.is_in_remote_control() in (True, False, None)
        assert (client.polyscope() + client.serial_number()).isprintable()
    return "read"


def _read_account(host: str) -> str:
    account = primary_interface.read_description(host, PATIENCE_S)
    return "told" if account.complete else "not all told"


@dataclass(frozen=True, slots=True)
class Reader:
    """A reader of the rig: its port, an undamaged dialogue, and the function that reads it."""

    port: int
    sound: Sequence[bytes]
    read: Callable[[str], str]


def _primary_states() -> Sequence[bytes]:
    robot = _laboratory().robot
    return [
        primary_package(16, b"".join(primary_package(kind, content(robot)) for kind, content in parts))
        for parts in (STATE, (*STATE, *CONFIGURATION), CONFIGURATION)
    ]


def readers() -> dict[str, Reader]:
    """Return the readers by their protocol's name."""
    return {
        "RTDE": Reader(rtde_packages.PORT, RTDE_ANSWERS, _read_states),
        "dashboard": Reader(dashboard.DASHBOARD_PORT, DASHBOARD_ANSWERS, _ask_dashboard),
        "primary": Reader(primary_interface.PORT, _primary_states(), _read_account),
    }


def _dialogue(name: str, random: Random, sound: Sequence[bytes]) -> tuple[list[bytes], bytes]:
    """Return an answer for each question, with unrequested messages, one of all damaged; and that message."""
    bad = damage_message(random, sound)
    if name == "RTDE":
        protocol, version, recipe, begun, state, message = sound
        messages = [protocol, version, recipe, begun, state, message, state]
    elif name == "dashboard":
        messages = [sound[0], sound[2], sound[4], sound[6], sound[7]]
    else:
        messages = [sound[0], sound[1]]
    messages[random.randrange(len(messages))] = bad
    if name == "RTDE":
        return [*messages[:3], b"".join(messages[3:])], bad
    if name == "dashboard":
        return [messages[0] + messages[1], *messages[2:]], bad
    return [b"".join(messages)], bad


def carry_to_rig(name: str, count: int, seed: int) -> Counter[str]:
    """Send `count` damaged messages to the rig's reader of a protocol; return the counts of its ends by name."""
    random, reader, ends = Random(f"{name} {seed}"), readers()[name], Counter[str]()
    controller = Controller(reader.port)
    try:
        for _ in range(count):
            parts, bad = _dialogue(name, random, reader.sound)
            with ending_by_name(bad):
                try:
                    ends[reader.read(controller.next(parts))] += 1
                except OSError as error:
                    ends[type(error).__name__] += 1
            controller.done()
    finally:
        controller.close()
    return ends


# -- the world's side --------------------------------------------------------------------------------------------------
_INPUTS = ",".join([*(f"input_int_register_{i}" for i in range(2)), *(f"input_double_register_{i}" for i in range(11))])
_OUTPUTS = "timestamp,actual_q,actual_qd,payload,payload_cog,output_int_register_0,actual_digital_output_bits"
COMMANDS = (0, 1, 2, 3, 4, 9, 11, 15, 16, 17, 26, 29, 31, 33, 34, 35, 37, 40, 43, 45, 46, 47, 58, 255)
NUMBERS = (0.0, 0.5, -1.5, 1.5, 7.0, 1e-300, 5e-324, 1e9, -1e308, 1e308, float("inf"), float("nan"))
SCRIPT = (
    "movej([0,-1,1,0,0,0], a=1, v=1)", "movel(p[0.1,0.2,0.3,0,0,0], a=1, v=0.2)", "speedj([0,0,0,0,0,1], 1, 0.1)",
    "stopj(2)", "set_digital_out(3, True)", "write_output_integer_register(1, 9)", "sleep(0.01)", "while True:", "end",
    "write_output_float_register(1, 0.5)", "set_payload(1.5, [0, 0, 0.1])", 'textmsg("hello")',
    "set_tcp(p[0,0,0,0,0,0])",
)  # fmt: skip
PROGRAM = (
    b"def rtde_control():\n  reg_offset_int = 0\n  0\n  # inject move path\n  movej([0,-1,1,0,0,0],a=1,v=1)\nend\n"
)
ORDERS = (
    b"quit", b"polyscopeversion", b"robotmode", b"safetymode", b"running", b"programstate", b"stop", b"play", b"pause",
    b"power on", b"power off", b"brake release", b"unlock protective stop", b"load wait_program.urp", b"popup hello",
    b"set operational mode manual", b"setuserrole operator", b"is in remote control", b"get serial number",
)  # fmt: skip


def _laboratory() -> Laboratory:
    loaded = ideal(DEMO)
    laboratory = Laboratory(loaded.config, read_world_section(loaded))
    laboratory.unplug()
    return laboratory


def _requests(random: Random) -> list[bytes]:
    """Return packages of an RTDE client, including commands to a control program."""
    numbers = [random.choice(NUMBERS) if random.random() < 0.3 else random.uniform(-3, 3) for _ in range(11)]
    data = struct.pack(">B2i11d", 1, random.choice(COMMANDS), random.randrange(2), *numbers)
    return [
        rtde_package("V", b"\0\2"), rtde_package("v", b""),
        rtde_package("O", struct.pack(">d", 125.0) + _OUTPUTS.encode()), rtde_package("I", _INPUTS.encode()),
        rtde_package("S", b""), rtde_package("P", b""), rtde_package("M", b"\2hi\1x\0"),
        *[rtde_package("U", data)] * 4,
    ]  # fmt: skip


def _program(random: Random) -> bytes:
    lines = "\n".join(random.choices(SCRIPT, k=1 + random.randrange(4)))
    return f"{random.choice(('def', 'sec'))} odd():\n{lines}\nend\n".encode()


SESSIONS: Mapping[str, Callable[[Robot], ClientSession]] = {
    "RTDE": RtdeSession,
    "dashboard": DashboardSession,
    "primary": PrimarySession,
}


def carry_to_world(name: str, count: int, seed: int) -> Counter[str]:
    """Send `count` damaged messages to the simulated controller's sessions of a protocol, a tick after each.

    Return the counts of its reactions. A session gets undamaged messages between the damaged ones. It is replaced when
    it closes, or after some messages, because it may be waiting for the rest of a message and read none of the
    following ones.
    """
    random, ends, laboratory = Random(f"{name} {seed}"), Counter[str](), _laboratory()
    session: ClientSession | None = None
    for number in range(count):
        if session is None or session.closing or number % SESSION == 0:
            if session is not None:
                session.handle_close()
                ends["hung up on"] += session.closing
            if number % RECOVERY == 0:
                _recover(laboratory)
            session = SESSIONS[name](laboratory.robot)
            session.greeting()
            if name == "RTDE":
                PrimarySession(laboratory.robot).receive(PROGRAM)
                session.receive(b"".join(_requests(random)[:5]))
        messages = {
            "RTDE": lambda: _requests(random),
            "dashboard": lambda: [order + b"\n" for order in ORDERS],
            "primary": lambda: [_program(random), _program(random), PROGRAM],
        }[name]()
        bad = damage_message(random, messages)
        with ending_by_name(bad):
            ends[_what_was_said(name, session.receive(bad), laboratory.robot)] += 1
            if random.random() < 0.3:
                session.receive(random.choice(messages))
            for _ in range(random.choice((1, 1, 30))):
                laboratory.turn()
                session.tick()
            assert all(abs(q) < 100 for q in laboratory.robot.motion.q_rad)
    return ends


def _what_was_said(name: str, answer: bytes, robot: Robot) -> str:
    if name == "RTDE":
        kinds = []
        while answer:
            (size,) = struct.unpack_from(">H", answer)
            kinds.append(chr(answer[2]))
            answer = answer[size:]
        return "refused by a message" if "M" in kinds else "answered" if kinds else "taken, or waiting for the rest"
    if name == "dashboard":
        refused = b"could not understand" in answer or b"Failed" in answer or b"not found" in answer
        return "refused in words" if refused else "answered" if answer else "waiting for the rest"
    newest = [message.kind.name for message in robot.messages.after(robot.messages.last - 1)]
    return "refused as an exception of the program" if newest == ["EXCEPTION"] else "taken, or waiting for the rest"


def _recover(laboratory: Laboratory) -> None:
    """Bring the controller back to power, without a stop or a program."""
    robot = laboratory.robot
    robot.stop_program("")
    robot.release()
    robot.safety_mode = SafetyMode.NORMAL
    robot.brake_release()
    robot.set_speed_slider(1.0)
    for _ in range(600):
        laboratory.turn()
