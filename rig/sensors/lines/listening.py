"""Ten seconds of an unknown device's lines, at the first usual baud rate that yields text."""

import time
from collections.abc import Callable

from rig.sensors.errors import SensorError
from rig.sensors.lines.decoding import MAX_LINE_BYTES
from rig.sensors.lines.shape import TimedLine
from rig.sensors.own_port import open_device_port

USUAL_BAUDS = (115200, 921600, 460800, 230400, 57600, 38400, 19200, 9600, 500000, 1000000, 250000, 2000000)
BAUD_TRIAL_S = 1.2  # at each baud rate
MIN_TEXT_FRACTION = 0.97
REST_S, TURNING_S = 4.0, 6.0
MAX_BYTES = MAX_LINE_BYTES + 100  # of a line that is too long anyway


def listen(
    port: str, baud: int | None, tell: Callable[[str], None], seconds: tuple[float, float] = (REST_S, TURNING_S)
) -> tuple[int, list[TimedLine], float]:
    """Return the baud rate, the lines, and the end of the device's rest, s, on the clock of the lines' arrival.

    `seconds`: the durations of the rest and of the turning after it; `tell` gets the operator's instructions. Raise
    SensorError `no_port`, `lines_silent`, `lines_wrong_baud_rate`, `lines_link_lost`.
    """
    speed = baud or _find_speed(port, tell)
    still_s, turned_s = seconds
    serial = open_device_port(port, speed)
    tell(f"lay it down and leave it alone for {still_s:g} s")
    lines: list[TimedLine] = []
    rest, began_s, is_moving = b"", time.monotonic(), False
    try:
        while (elapsed_s := time.monotonic() - began_s) < still_s + turned_s:
            if elapsed_s > still_s and not is_moving:
                is_moving = True
                tell(f"now turn it in your hand, about every axis, by half a turn and back, for {turned_s:g} s")
            *complete, rest = (rest[:MAX_BYTES] + serial.read()).replace(b"\r", b"\n").split(b"\n")
            arrived_s = time.monotonic() - began_s
            lines += [TimedLine(arrived_s, line[:MAX_BYTES].decode("ascii", "replace")) for line in complete if line]
    except OSError as error:
        raise SensorError(
            "lines_link_lost", f"the port {port} closed: {error}", "Check its supply and cable"
        ) from error
    finally:
        serial.close()
    if not lines:
        raise _silent(port)
    return speed, lines[1:], still_s


def _find_speed(port: str, tell: Callable[[str], None]) -> int:
    """Return the first usual baud rate at which text arrives, and report it by `tell`.

    Raise SensorError `lines_silent`, `lines_wrong_baud_rate`.
    """
    if port.startswith("socket://"):
        return USUAL_BAUDS[0]  # a socket has no baud rate
    has_input = False
    for baud in USUAL_BAUDS:
        data = _read_at(port, baud)
        has_input = has_input or bool(data)
        like_text = sum(32 <= byte < 127 or byte in b"\r\n\t\x1b" for byte in data)
        if len(data) > 20 and like_text > MIN_TEXT_FRACTION * len(data) and (b"\n" in data or b"\r" in data):
            tell(f"{port} sends at {baud} Bd")
            return baud
    if not has_input:
        raise _silent(port)
    raise SensorError(
        "lines_wrong_baud_rate",
        f"the data from {port} is text at none of {', '.join(map(str, USUAL_BAUDS))} Bd",
        "Give the speed that the device's program sets with --baud; it may print no lines but binary messages",
    )


def _read_at(port: str, baud: int) -> bytes:
    """Return the bytes that arrive at `baud` within `BAUD_TRIAL_S`, about 2000 at most; empty if the port fails."""
    serial = open_device_port(port, baud)
    try:
        serial.read()  # discard input received at another speed
        data, until_s = b"", time.monotonic() + BAUD_TRIAL_S
        while time.monotonic() < until_s and len(data) < 2000:
            data += serial.read()
        return data
    except OSError:
        return b""
    finally:
        serial.close()


def _silent(port: str) -> SensorError:
    return SensorError(
        "lines_silent", f"nothing came from {port}", "Check its supply and cable, and that its program prints"
    )
