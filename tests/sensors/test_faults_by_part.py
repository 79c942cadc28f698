"""What is wrong with a sensor on a port of its own has the name that its part gives it: part by fault."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from itertools import chain, count, islice, repeat
from typing import Any

import pytest

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_source import kvh1775
from rig.sensors.lines.lines_source import lines
from rig.sensors.mavlink.autopilot_source import mavlink
from rig.sensors.port_silence import PATIENCE, Patience
from rig.sensors.sample_source import OnSamples
from rig.world.board.serial_line import misread
from support.processes.waiting import wait_for
from support.wires import autopilot_on_a_wire as autopilots
from support.wires import kvh_on_a_wire as kvhs
from support.wires.printed_lines import pty_printing, sensor_section

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")]

ROWS = """
fault                 lines                  mavlink               kvh1775
no such port          no_port                no_port               no_port
silent                lines_silent           no_autopilot          no_kvh
wrong baud rate       lines_wrong_baud_rate  mavlink_no_message    kvh_wrong_baud_rate
other device          lines_other_format     mavlink_other_device  kvh_other_serial_number
garbage               lines_wrong_baud_rate  mavlink_no_message    -
too slow              lines_other_rate       autopilot_rate        -
unplugged             lines_link_lost        mavlink_link_lost     kvh_link_lost
falls silent          lines_link_lost        mavlink_link_lost     kvh_link_lost
turns into garbage    lines_damaged          mavlink_link_lost     kvh_link_lost
begins anew           lines_time_jumped      mavlink_link_lost     kvh_restarted
nobody takes it       lines_not_taken        mavlink_not_taken     kvh_not_taken
"""  # the rig sets the rate of a KVH 1775, and garbage is a wire or a rate to it, as it comes
LATER = ("unplugged", "falls silent", "turns into garbage", "begins anew", "nobody takes it")
NO_PORT = "/dev/there-is-none"
AT_ONCE = (  # seen in what comes; the others by waiting for what does not
    "lines_other_rate", "autopilot_rate", "lines_damaged", "lines_time_jumped", "kvh_restarted",
    "kvh_other_serial_number", "lines_not_taken", "mavlink_not_taken", "kvh_not_taken",
)  # fmt: skip
Bench = tuple[AbstractContextManager[Any], Callable[[], object]]  # a source that connects, and what goes wrong later


def table() -> Iterator[tuple[str, str, str]]:
    """Part, fault and the error's name."""
    rows = ([word.strip() for word in line.split("  ") if word.strip()] for line in ROWS.strip().split("\n"))
    _, *parts = next(rows)
    for fault, *names in rows:
        yield from ((part, fault, name) for part, name in zip(parts, names, strict=True) if name != "-")


def printed(begin: int, step: int = 1) -> Iterator[bytes]:
    """Ten lines at a time."""
    rows = (b"%d,1.5,-2.25,3,0.5,-0.25,1\r\n" % (step * number * 10_000) for number in count(begin))
    while True:
        yield b"".join(islice(rows, 10))


def taking(fault: str) -> OnSamples:
    """Who takes the samples."""

    def fail(*_: object) -> None:
        raise ValueError("no room")

    return fail if fault == "nobody takes it" else lambda *_: None


@contextmanager
def of_lines(fault: str, patience: Patience) -> Iterator[Bench]:
    """A device that prints lines."""
    good = list(islice(printed(10**5), 15))
    streams: dict[str, Any] = {
        "silent": (),
        "wrong baud rate": (misread(chunk, 115200, 921600) for chunk in printed(0)),
        "other device": repeat(b"$GPGGA,1234,N,11*47\r\n"),
        "garbage": repeat(b"\x00\xfe\x91" * 40),
        "too slow": printed(0, 2),
        "falls silent": good,
        "turns into garbage": chain(good, repeat(b"Guru Meditation Error\r\n" * 20)),
        "begins anew": chain(good, printed(0)),
    }
    with pty_printing(streams.get(fault, printed(0))) as (port, unplugged):
        section = sensor_section(NO_PORT if fault == "no such port" else port)
        yield (
            lines("imu", section, taking(fault), patience=patience),
            (unplugged.set if fault == "unplugged" else lambda: None),
        )


@contextmanager
def of_mavlink(fault: str, patience: Patience) -> Iterator[Bench]:
    """An autopilot."""
    with autopilots.autopilot_on_a_wire(dead=fault == "silent", uptime_s=100.0) as wire:
        spoil: dict[str, Callable[[], object]] = {
            "wrong baud rate": lambda: None,
            "other device": partial(setattr, wire.faults, "camera", True),
            "garbage": partial(setattr, wire.line, "bit_error_rate", 0.3),
            "too slow": partial(setattr, wire.faults, "slowest", 0.8),
            "unplugged": wire.switch_off,
            "falls silent": partial(setattr, wire.line, "silent", True),
            "turns into garbage": partial(setattr, wire.line, "bit_error_rate", 0.3),
            "begins anew": wire.switch_on,  # it has forgotten what it was asked for
        }
        if fault not in LATER:
            wire.wire.order(spoil.get(fault, lambda: None))
        port = NO_PORT if fault == "no such port" else wire.port
        changes: dict[str, Any] = {"baud": 57600, "rate_hz": 20} if fault == "wrong baud rate" else {}
        sections = {"imu": autopilots.section(port, **changes)}
        yield mavlink(sections, taking(fault), patience=patience), spoil.get(fault, lambda: None)


@contextmanager
def of_kvh(fault: str, patience: Patience) -> Iterator[Bench]:
    """A KVH 1775."""
    left = {"BAUD": "115200"} if fault == "wrong baud rate" else {}
    with kvhs.kvh_on_a_wire(left, dead=fault == "silent") as wire:
        spoil: dict[str, Callable[[], object]] = {
            "unplugged": lambda: wire.order(lambda kvh: setattr(wire, "kvh", None)),
            "falls silent": partial(setattr, wire.line, "silent", True),
            "turns into garbage": partial(setattr, wire.line, "bit_error_rate", 0.3),
            "begins anew": wire.switch_on,
        }
        specimen = "another" if fault == "other device" else kvhs.SERIAL_NUMBER
        section = kvhs.section(NO_PORT if fault == "no such port" else wire.port, serial_number=specimen)
        yield kvh1775("kvh", section, taking(fault), patience=patience), spoil.get(fault, lambda: None)


BENCHES = {"lines": of_lines, "mavlink": of_mavlink, "kvh1775": of_kvh}


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("part", "fault", "name"), list(table()))
def test_a_fault_has_its_parts_name(part: str, fault: str, name: str) -> None:
    patience = Patience(silent_s=0.5) if fault in LATER else Patience(first_s=1.0)
    with (
        pytest.raises(SensorError) as caught,
        BENCHES[part](fault, PATIENCE if name in AT_ONCE else patience) as (connecting, spoil),
        connecting as source,
    ):
        assert fault in LATER, "it connects in spite of it"
        source.start()
        spoil()
        wait_for(source.check, "its fault")
    assert caught.value.name == name
    assert f"sensors.{'kvh' if part == 'kvh1775' else 'imu'}" in str(caught.value)
