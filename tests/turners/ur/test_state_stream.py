"""The arm's states as they come over the wire, whole or in pieces, and controllers that do not send them."""

import math
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import pairwise

import pytest

from rig.errors import Refused
from rig.turners.ur.arm_driver import look
from rig.turners.ur.controller.rtde_packages import HEADER, PORT
from rig.turners.ur.controller.state_checks import clock_step
from rig.turners.ur.controller.state_stream import PACKET, VARIABLES, StateStream
from support.laboratories.worlds import fresh_host
from support.processes.waiting import PATIENCE_S, wait_for

TYPES = ",".join(VARIABLES.values()).encode()


def package(kind: str, payload: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(payload), ord(kind)) + payload


PERIOD_S = 1 / 125
QD_RAD_S = 0.1


def data(number: float) -> bytes:
    """A state so many periods after the start, of an arm whose joints turn at `QD_RAD_S`."""
    return package("U", PACKET.pack(*values(number)))


def values(number: float) -> list[float]:
    time_s = number * PERIOD_S
    q_rad = [joint + QD_RAD_S * time_s for joint in range(6)]
    return [1, time_s, *q_rad, *[QD_RAD_S] * 6, 1.0, 1.0, 7, 1, 2, 3, 1, 0.35, 0.0, 0.0, 0.025]


MESSAGE = package("M", b"\2hi\4RTDE\1")
VERSION = package("v", struct.pack(">4I", 5, 14, 0, 0))
ANSWERS = {"V": package("V", b"\1"), "v": VERSION, "O": package("O", b"\1" + TYPES), "S": package("S", b"\1")}

Send = Callable[[bytes], None]


class Controller:
    """Answers the questions of one client by `answers`; `send` sends it what a test likes."""

    def __init__(self, answers: dict[str, bytes]) -> None:
        self.host = fresh_host()
        self._answers = answers
        self._listener = socket.create_server((self.host, PORT))
        self._client: socket.socket | None = None
        self._server = threading.Thread(target=self._serve, daemon=True)
        self._server.start()

    def _serve(self) -> None:
        self._client, _ = self._listener.accept()
        with suppress(OSError):  # a client that has heard enough hangs up, and a test that has seen enough
            for kind in "VvOS":
                asked = b""
                while len(asked) < HEADER.size or len(asked) < HEADER.unpack_from(asked)[0]:
                    if not (more := self._client.recv(4096)):
                        return
                    asked += more
                assert chr(asked[2]) == kind
                self._client.sendall(self._answers.get(kind, b""))

    def send(self, sent: bytes) -> None:
        assert self._client is not None
        self._client.sendall(sent)

    def keeps_nothing(self) -> None:
        """From now on what the client's system has no room for is not taken from the test."""
        assert self._client is not None
        self._client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # nor is it waited for more to send at once
        self._client.settimeout(PATIENCE_S)

    def hang_up(self) -> None:
        if self._client is not None:
            self._client.close()

    def close(self) -> None:
        self.hang_up()
        self._server.join(PATIENCE_S)
        self._listener.close()


@pytest.fixture
def controllers() -> Iterator[Callable[..., Controller]]:
    running: list[Controller] = []

    def start(**changed: bytes) -> Controller:
        running.append(Controller({**ANSWERS, **changed}))
        return running[-1]

    yield start
    for each in running:
        each.close()


Controllers = Callable[..., Controller]


def numbers_of(stream: StateStream, count: int) -> list[float]:
    """How many periods after the start the next packets were made."""
    times_s: list[float] = []

    def enough() -> bool:
        times_s.extend(packet.state.time_s for packet in stream.read(0.01))
        return len(times_s) >= count

    wait_for(enough, f"{count} states")
    return [round(time_s / PERIOD_S, 3) for time_s in times_s]


def test_every_state_comes_in_order_also_in_pieces_and_among_messages(controllers: Controllers) -> None:
    controller = controllers(S=MESSAGE + ANSWERS["S"] + MESSAGE + data(1.0) + data(2.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        assert stream.first.state.time_s == PERIOD_S
        for byte in data(3.0) + MESSAGE + data(4.0):
            controller.send(bytes([byte]))
        assert numbers_of(stream, 3) == [2.0, 3.0, 4.0]


def test_states_wait_for_a_reader_that_is_held_up(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(b"".join(data(float(k)) for k in range(1, 300)))
        assert numbers_of(stream, 299) == [float(k) for k in range(1, 300)]


@pytest.mark.skipif(sys.platform != "linux", reason="others may give less room")
def test_two_seconds_of_states_wait_also_where_the_controller_keeps_none(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.keeps_nothing()
        for k in range(1, 1001):
            controller.send(data(float(k)))  # waits, and times out, where there is no more room
        assert numbers_of(stream, 1000) == [float(k) for k in range(1, 1001)]


@pytest.mark.slow
def test_a_silence_is_what_has_not_come_however_late_one_looks(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(data(1.0))
        time.sleep(0.3)  # a reader that gets no processor
        began_s = time.monotonic()
        assert numbers_of(stream, 1) == [1.0] and stream.silent_s == 0.0
        time.sleep(0.3)
        assert stream.read(0.01) == [] and 0.3 <= stream.silent_s <= time.monotonic() - began_s
        controller.send(data(2.0)[:5])  # a part of a state is a sign of life, too
        assert stream.read(5.0) == [] and stream.silent_s == 0.0
        controller.hang_up()
        assert stream.read(0.01) == [] and stream.closed
        time.sleep(0.1)
        assert stream.read(0.0) == [] and stream.silent_s >= 0.1


def test_a_state_says_what_the_controller_sent(controllers: Controllers) -> None:
    with StateStream(controllers(S=ANSWERS["S"] + data(1)).host, 125.0, 5.0) as stream:
        first = stream.first
    state = first.state
    assert (state.q_rad, state.qd_rad_s) == (tuple(values(1)[2:8]), (QD_RAD_S,) * 6)
    assert (state.robot_mode, state.safety_mode, state.runtime_state) == (7, 1, 2)
    assert (state.robot_status_bits, state.safety_status_bits) == (3, 1)
    assert (first.payload_kg, first.payload_centre_m) == (0.35, (0.0, 0.0, 0.025))


def test_a_connection_that_closes_gives_no_more_states(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(1.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.hang_up()
        wait_for(lambda: stream.read(0.01) == [] and stream.closed, "the end")
        began_s = time.monotonic()
        assert stream.read(0.05) == [] and time.monotonic() - began_s > 0.04, "it must not spin"


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({2: 1e4}, "base is at 1e+04 rad"),
        ({8: -21.0}, "base is at 0.0024 rad and turns at -21 rad/s"),
        ({7: float("nan")}, "wrist_3 is nan"),
        ({4: float("inf")}, "elbow is inf"),
        ({14: 1.5}, "speed slider is at 150 %"),
        ({15: float("nan")}, "speed scaling is nan"),
        ({17: 256}, "safety_mode is 256"),
        ({1: float("inf")}, "time is inf"),
        ({21: float("nan")}, "payload is nan kg"),
        ({7: values(3)[7] + math.tau}, "wrist_3 went by +360.0° in 0.008 s"),
        ({2: 0.2}, "base went by"),
    ],
    ids=str,
)
def test_a_state_that_no_arm_is_in_is_given_up_by_its_own_name(
    controllers: Controllers, changed: dict[int, float], said: str
) -> None:
    """Those before it are read; nothing that follows is believed."""
    bad = values(3)
    for place, value in changed.items():
        bad[place] = value
    controller = controllers(S=ANSWERS["S"] + data(1))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(data(2) + package("U", PACKET.pack(*bad)) + data(4))
        assert numbers_of(stream, 1) == [2.0]
        wait_for(lambda: stream.read(0.01) == [] and stream.closed, "the end")
    assert stream.problem is not None and stream.problem.name == "arm_state_impossible"
    assert said in stream.problem.what, stream.problem.what


@pytest.mark.slow
def test_an_arm_in_an_impossible_state_from_the_first_is_refused_so(controllers: Controllers) -> None:
    bad = values(1)
    bad[5] = float("nan")
    controller = controllers(S=ANSWERS["S"] + package("U", PACKET.pack(*bad)))
    with pytest.raises(Refused) as refused:
        look(controller.host)
    assert refused.value.name == "arm_state_impossible" and "wrist_1 is nan" in refused.value.what


@pytest.mark.parametrize("short_by", [1, 8])
def test_a_state_of_another_length_is_a_lost_link(controllers: Controllers, short_by: int) -> None:
    controller = controllers(S=ANSWERS["S"] + data(1))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(package("U", PACKET.pack(*values(2))[:-short_by]))
        assert stream.read(5.0) == [] and stream.closed and stream.problem is None


@pytest.mark.parametrize(
    ("numbers", "sound"),
    [
        ([2, 3, 5, 9], True),
        ([2, 3, 3 + 1 / PERIOD_S], False),
        ([2, 3, 3 - 0.5 / PERIOD_S], False),
        ([2, 3, 3 + 0.2 / PERIOD_S], False),
        ([2, 3, 4.5], False),
        ([2, 3, 3], False),
    ],
    ids=["lost states", "+1 s", "-0.5 s", "+0.2 s", "between two", "twice"],
)
def test_a_time_that_is_not_the_last_one_and_periods_is_a_clock_that_was_set(
    controllers: Controllers, numbers: list[float], sound: bool
) -> None:
    controller = controllers(S=ANSWERS["S"] + data(1))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(b"".join(map(data, numbers)))
        read = numbers_of(stream, len(numbers) if sound else len(numbers) - 1)
        assert read == (numbers if sound else numbers[:-1])
        assert (stream.problem is None) == sound and not stream.closed
        assert stream.problem is None or stream.problem.name == "arm_clock_stepped"
        controller.send(data(numbers[-1] + 1))
        assert numbers_of(stream, 1) == [round(numbers[-1] + 1, 3)], "states go on, and tell whether the arm stands"


@pytest.mark.parametrize(
    ("step_s", "missed_s", "sound"), [(0.504, 0.0, False), (0.504, 0.6, True), (1.0, 0.6, False), (-0.008, 5.0, False)]
)
def test_states_that_a_network_lost_are_none_where_nothing_came_for_as_long(
    step_s: float, missed_s: float, sound: bool
) -> None:
    assert (clock_step(10.0, 10.0 + step_s, PERIOD_S, missed_s) is None) == sound


@pytest.mark.parametrize("rate_hz", [125.0, 500.0, 300.0, 60.0, 7.0])
def test_states_at_any_rate_follow_each_other(rate_hz: float) -> None:
    """A controller makes them at the ends of its cycles of 2 ms, now earlier, now later."""
    times_s = [0.002 * math.floor(number / rate_hz / 0.002 + 1e-9) for number in range(100)]
    assert [clock_step(a, b, 1 / rate_hz, 0.0) for a, b in pairwise(times_s)] == [None] * 99


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answers", "said"),
    [
        ({"V": package("V", b"\0")}, "version 2"),
        ({"O": package("O", b"\1" + TYPES.replace(b"VECTOR3D", b"NOT_FOUND"))}, "payload_cog"),
        ({"O": package("O", b"\0")}, "timestamp"),
        ({"S": package("S", b"\0")}, "does not start"),
        ({"S": ANSWERS["S"]}, "does not answer"),
        ({"V": b"HTTP/1.1 400 Bad Request\r\n"}, "does not answer|RTDE"),
        ({"V": b"\0\0\0\0"}, "not RTDE"),
    ],
    ids=["version", "a variable", "no recipe", "start", "silence", "another protocol", "zeros"],
)
def test_a_controller_that_sends_no_states_is_an_error_that_says_why(
    controllers: Controllers, answers: dict[str, bytes], said: str
) -> None:
    with pytest.raises(OSError, match=said):
        StateStream(controllers(**answers).host, 125.0, 0.5)


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "unknown"),
    [
        ({"V": package("V", b"\0")}, "version 2 of RTDE"),
        ({"O": package("O", b"\1" + TYPES.replace(b"VECTOR3D", b"NOT_FOUND"))}, "payload_cog"),
    ],
    ids=["protocol", "field"],
)
@pytest.mark.parametrize(
    ("version", "name"), [((5, 3, 0, 1), "controller_too_old"), ((3, 2, 1, 0), "cb3_not_supported")]
)
def test_a_controller_that_is_too_old_is_told_so_and_not_to_look_at_its_firewall(
    controllers: Controllers, changed: dict[str, bytes], unknown: str, version: tuple[int, ...], name: str
) -> None:
    controller = controllers(**changed, v=package("v", struct.pack(">4I", *version)))
    with socket.create_server((controller.host, 29999)), pytest.raises(Refused) as refused:
        look(controller.host)
    assert refused.value.name == name and "firewall" not in refused.value.remedy
    assert ".".join(map(str, version[:3])) in refused.value.what
    assert name != "controller_too_old" or unknown in refused.value.what
