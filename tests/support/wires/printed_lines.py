"""Lines as devices print them, and a pseudo-terminal that prints them."""

import os
import select
import threading
import time
import tty
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import reduce
from operator import xor
from typing import Any

from rig.config.sensors.lines_section import LinesSection
from rig.config.sensors.sensor_sections import SensorSection

SEVEN = ("time", "gx", "gy", "gz", "ax", "ay", "az")


def lines_section(**changes: Any) -> LinesSection:
    """Return a section of seven columns with these changes; None removes a key."""
    usual: dict[str, Any] = {
        "columns": SEVEN,
        "time": {"unit": "us"},
        "rate": {"unit": "deg/s"},
        "acceleration": {"unit": "g"},
        "temperature": {"stated_c": 22},
    }
    document = {key: value for key, value in {**usual, **changes}.items() if value is not None}
    return LinesSection.model_validate(document)


def sensor_section(port: str, *, rate_hz: float = 100, **changes: Any) -> SensorSection:
    """Return the section of a sensor at `port`; `changes` are those of its section `lines`."""
    lines = lines_section(**changes)
    read = {"acceleration": {"range_g": 8}} if lines.acceleration is not None else {}
    document = {
        "part": "lines", "serial_number": "L-1", "rate_hz": rate_hz, "range_deg_s": 500,
        "serial": {"port": port, "baud": 921600}, "lines": lines.model_dump(), **read,
    }  # fmt: skip
    return SensorSection.model_validate(document)


def add_checksum(text: str) -> bytes:
    """Return a line with its checksum as in NMEA."""
    return f"{text}*{reduce(xor, text.lstrip('$!').encode(), 0):02X}\r\n".encode()


@contextmanager
def pty_printing(chunks: Iterable[bytes], pace_s: float = 0.01) -> Iterator[tuple[str, threading.Event]]:
    """Yield a port that prints one of `chunks` every `pace_s`, and an event that unplugs it."""
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)  # without a reader it fills up, which must not delay the end
    ending, unplugged = threading.Event(), threading.Event()

    def over() -> bool:
        return ending.is_set() or unplugged.is_set()

    def run() -> None:
        for chunk in chunks:
            rest = chunk
            while rest and not over():
                if select.select([], [master], [], 0.01)[1]:
                    rest = rest[os.write(master, rest) :]
            if over():
                break
            time.sleep(pace_s)
        while not over():
            time.sleep(0.01)
        os.close(slave)
        os.close(master)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave), unplugged
    finally:
        ending.set()
        thread.join()
