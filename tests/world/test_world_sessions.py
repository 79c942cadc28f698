"""Nothing a client sends can end the simulated laboratory."""

import struct
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.config.load import load
from rig.errors import Refused
from rig.world.laboratory import Laboratory
from rig.world.network import ClientSession
from rig.world.ur10e.interfaces.dashboard_server import DashboardSession
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.interfaces.rtde import RtdeSession
from rig.world.ur10e.interfaces.variables import INPUTS, OUTPUTS
from rig.world.ur10e.robot import Robot
from rig.world.world_process import World
from rig.world.world_section import read_world_section
from support.laboratories.worlds import fresh_host
from support.paths import DEMO
from support.wires.damaged_messages import carry_to_world

LOADED = load(DEMO)
LABORATORY = Laboratory(LOADED.config, read_world_section(LOADED))
LABORATORY.unplug()

statements = st.sampled_from(
    [
        "movej([0,-1,1,0,0,0], a=1, v=1)",
        "movej([0,-1,1,0,0,0,7])",
        "movej([1e400,0,0,0,0,0], a=1, v=nan)",
        "movej(p[9,9,9,0,0,0])",
        "movel(p[0.1,0.2,0.3,0,0,0], a=1e9, v=1e9)",
        "speedj([0,0,0,0,0,1], a=0)",
        "speedj([0,0,0,0,0,1e400], 1)",
        "stopj(0)",
        "set_digital_out(99, True)",
        "write_output_integer_register(99, 1)",
        "write_output_integer_register(1, 99999999999)",
        "write_output_float_register(1, [1])",
        "set_payload(-1)",
        "sleep(x)",
        "textmsg(a, b",
        "while True:",
        "end",
        "sec other():",
        "def again():",
        "set robotmode run",
        "protective_stop()",
    ]
)


def play(session: ClientSession, data: bytes) -> None:
    """Feed a session and let some time pass."""
    assert isinstance(session.greeting(), bytes)
    assert isinstance(session.receive(data), bytes)
    for _ in range(60):
        LABORATORY.step()
        assert isinstance(session.tick(), bytes)
    session.handle_close()
    robot = LABORATORY.robot
    robot.stop_program("")
    robot.release()
    robot.safety_mode = type(robot.safety_mode).NORMAL
    robot.brake_release()
    assert all(abs(q) < 100 for q in robot.motion.q_rad)


@given(st.sampled_from([RtdeSession, DashboardSession, PrimarySession]), st.binary(max_size=200))
def test_noise(new_session: Callable[[Robot], ClientSession], data: bytes) -> None:
    play(new_session(LABORATORY.robot), data + b"\n")


@pytest.mark.slow
@given(st.lists(statements, max_size=6))
def test_programs_that_cannot_be_right(lines: list[str]) -> None:
    text = "\n".join(["def odd():", *(f"  {line}" for line in lines), "end", ""])
    play(PrimarySession(LABORATORY.robot), text.encode())


@pytest.mark.slow
@given(
    st.lists(st.sampled_from(sorted(OUTPUTS)), max_size=8),
    st.lists(st.sampled_from(sorted(INPUTS)), max_size=4),
    st.floats(),
    st.binary(max_size=40),
)
def test_any_recipe_at_any_rate(outputs: list[str], inputs: list[str], rate_hz: float, data: bytes) -> None:
    parts = [
        (b"V", struct.pack(">H", 2)),
        (b"O", struct.pack(">d", rate_hz) + ",".join(outputs).encode()),
        (b"I", ",".join(inputs).encode()),
        (b"S", b""),
        (b"U", b"\1" + data),
        (b"P", b""),
        (b"V", b""),
    ]
    stream = b"".join(struct.pack(">HB", 3 + len(body), kind[0]) + body for kind, body in parts)
    play(RtdeSession(LABORATORY.robot), stream)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["RTDE", "dashboard", "primary"])
def test_damaged_messages(name: str) -> None:
    """A hundred thousand of them: benchmarks/wire/damaged_frames.py."""
    ends = carry_to_world(name, 300, seed=1)
    refused = sum(count for end, count in ends.items() if end.startswith("refused"))
    assert refused > 20, ends


@pytest.mark.parametrize(
    "program",
    [
        "def odd():\n movej([0,0,0,0,0,0]) + f(1)\nend\n",
        'def odd():\n textmsg("\\ud800")\nend\n',
        "def odd():\n set_payload(1, [0, 0])\nend\n",
        'def odd():\n set_payload(1, "abc")\nend\n',
        "def odd():\n sleep(" + "(" * 5000 + ")\nend\n",
        "def odd():\n" + " while True:\n" * 2000 + " end\n" * 2000 + "end\n",
        "def rtde_control():\n reg_offset_int = 0\n 40\nend\n",
        "def rtde_control():\n # inject move path\n movej([0,0,0,0,0,0], a=1, v=" + "9" * 400 + ")\nend\n",
        "def odd():\n movej([0,0,0,0,0,1], a=5e-324, v=1)\nend\n",
    ],
    ids=range(9),
)
def test_programs_that_once_ended_the_laboratory(program: str) -> None:
    watching = RtdeSession(LABORATORY.robot)
    recipe = struct.pack(">d", 500.0) + b"payload,payload_cog"
    for kind, body in ((b"V", b"\0\2"), (b"O", recipe), (b"S", b"")):
        watching.receive(struct.pack(">HB", 3 + len(body), kind[0]) + body)
    session = PrimarySession(LABORATORY.robot)
    session.greeting()
    session.receive(program.encode())
    for _ in range(30):
        LABORATORY.turn()
        assert watching.tick() and isinstance(session.tick(), bytes)
    LABORATORY.robot.stop_program("")


def test_a_client_may_not_ask_for_more_than_there_is() -> None:
    """Input recipes without end, a command and a program without end: refused in words, and not kept."""
    rtde, dashboard, script = (session(LABORATORY.robot) for session in (RtdeSession, DashboardSession, PrimarySession))
    recipe = b"input_int_register_40"
    answers = [rtde.receive(struct.pack(">HB", 3 + len(recipe), ord("I")) + recipe) for _ in range(300)]
    assert answers[254][3] == 255 and answers[255].endswith(b"\0\x04I\0")
    rtde.handle_close()
    assert b"not RTDE" in rtde.receive(b"\0\0\0") and rtde.closing
    said = b"".join(dashboard.receive(b"x" * 10_000) for _ in range(7))
    assert said.startswith(b"could not understand: a line of more than") and dashboard.closing
    script.greeting()
    for _ in range(17):
        script.receive(b"def odd():\n" + b" sleep(1)\n" * 6600)
    assert script.closing and b"bytes is not accepted" in script.tick()


@pytest.mark.parametrize("port", ["socket://127.0.0.1", "socket://127.0.0.1:x", "/dev/ttyACM0"])
def test_a_board_port_that_is_no_address_is_refused(port: str) -> None:
    board = LOADED.config.board
    assert board is not None
    turner = LOADED.config.arm.model_copy(update={"host": fresh_host()})
    update = {"board": board.model_copy(update={"port": port}), "turner": turner}
    with pytest.raises(Refused, match="board_port"):
        World(replace(LOADED, config=LOADED.config.model_copy(update=update)))
