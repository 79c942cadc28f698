"""The latency timer of FTDI converters, which hold received bytes for 16 ms by default.

Adapters for these servos (U2D2 and similar) have such a chip. Linux shows its timer in
/sys/bus/usb-serial/devices/ttyUSB*/latency_timer; a request for low latency (TIOCSSERIAL, by pyserial, without special
rights) sets it to 1 ms. Other ports have no such file and nothing to set.
"""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused

if TYPE_CHECKING:
    import serial

DEVICES = Path("/sys/bus/usb-serial/devices")
MAX_LATENCY_MS = 2


def lower_latency(port: "serial.Serial", path: str, devices: Path = DEVICES) -> None:
    """Make the adapter deliver received bytes at once. Raise Refused `servo_adapter_slow` if the timer remains long."""
    timer = devices / Path(path).resolve().name / "latency_timer"
    with suppress(ValueError, OSError, AttributeError, NotImplementedError):  # a port without a latency timer
        port.set_low_latency_mode(True)
    timer_ms = _read_ms(timer)
    if timer_ms is not None and timer_ms > MAX_LATENCY_MS:
        with suppress(OSError):
            timer.write_text("1")
        timer_ms = _read_ms(timer)
    if timer_ms is not None and timer_ms > MAX_LATENCY_MS:
        raise Refused(
            "servo_adapter_slow",
            f"the adapter at {path} passes data on only every {timer_ms} ms, and that cannot be changed",
            f"Write 1 into {timer} as root, or add a udev rule: "
            'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"',
        )


def _read_ms(timer: Path) -> int | None:
    try:
        return int(timer.read_text())
    except (OSError, ValueError):
        return None
