"""Ten seconds of an unknown device's lines, at whichever of the usual speeds they are lines."""

import time
from collections.abc import Callable

from rig.sensors.errors import SensorError
from rig.sensors.lines.decoding import LONGEST_LINE
from rig.sensors.lines.shape import Line
from rig.sensors.own_port import opened

USUAL = (115200, 921600, 460800, 230400, 57600, 38400, 19200, 9600, 500000, 1000000, 250000, 2000000)
TRIED_S = 1.2  # at each speed
LIKE_TEXT = 0.97
STILL_S, TURNED_S = 4.0, 6.0
ENDLESS = LONGEST_LINE + 100  # bytes of a line that are kept: it is too long in any case


def listen(
    port: str, baud: int | None, tell: Callable[[str], None], seconds: tuple[float, float] = (STILL_S, TURNED_S)
) -> tuple[int, list[Line], float]:
    """The speed, the lines, and until when the device was to lie still, by the clock of their arrival.

    `tell` says what to do, as it comes. Raises SensorError `no_port`, `lines_silent`, `lines_wrong_baud_rate`.
    """
    found = baud or _speed(port, tell)
    still_s, turned_s = seconds
    tell(f"lay it down and leave it alone for {still_s:g} s")
    serial = opened(port, found)
    lines: list[Line] = []
    rest, began_s, told = b"", time.monotonic(), False
    try:
        while (at_s := time.monotonic() - began_s) < still_s + turned_s:
            if at_s > still_s and not told:
                told = True
                tell(f"now turn it in your hand, about every axis, by half a turn and back, for {turned_s:g} s")
            *whole, rest = (rest[:ENDLESS] + serial.read()).replace(b"\r", b"\n").split(b"\n")
            arrived_s = time.monotonic() - began_s
            lines += [Line(arrived_s, each[:ENDLESS].decode("ascii", "replace")) for each in whole if each]
    except OSError as error:
        raise SensorError(
            "lines_link_lost", f"the port {port} closed: {error}", "Check its supply and cable"
        ) from error
    finally:
        serial.close()
    if not lines:
        raise _silent(port)
    return found, lines[1:], still_s


def _speed(port: str, tell: Callable[[str], None]) -> int:
    """The first of the usual speeds at which what comes is text."""
    if port.startswith("socket://"):
        return USUAL[0]  # which carries none
    anything = False
    for baud in USUAL:
        heard = _heard(port, baud)
        anything = anything or bool(heard)
        like_text = sum(32 <= each < 127 or each in b"\r\n\t\x1b" for each in heard)
        if len(heard) > 20 and like_text > LIKE_TEXT * len(heard) and (b"\n" in heard or b"\r" in heard):
            tell(f"{port} speaks at {baud} Bd")
            return baud
    if not anything:
        raise _silent(port)
    raise SensorError(
        "lines_wrong_baud_rate",
        f"what comes from {port} is text at none of {', '.join(map(str, USUAL))} Bd",
        "Give the speed that the device's program sets with --baud; it may print no lines but binary messages",
    )


def _heard(port: str, baud: int) -> bytes:
    serial = opened(port, baud)
    try:
        serial.read()  # what stands there was read at another speed
        heard, until_s = b"", time.monotonic() + TRIED_S
        while time.monotonic() < until_s and len(heard) < 2000:
            heard += serial.read()
        return heard
    except OSError:
        return b""
    finally:
        serial.close()


def _silent(port: str) -> SensorError:
    return SensorError(
        "lines_silent", f"nothing came from {port}", "Check its supply and cable, and that its program prints"
    )
