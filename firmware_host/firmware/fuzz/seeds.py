"""Write the fuzzer's first inputs: `python -m firmware_host.firmware.fuzz.seeds FOLDER`.

Every request of the table once, as zeros and in typical sessions: streams, observations, calibrations.
"""

import sys
from pathlib import Path
from typing import Any

from firmware_host.parts import BOARD_PARTS, GYROSCOPES
from firmware_host.protocol import MESSAGES, Message

# Actions of fuzz_board.c by byte
NOISE, FRAME, CONVERT, WAIT, DISTURB, LINE, FLASH = range(7)

_BY_NAME = {message.name: message for message in MESSAGES}


def frame(name: str, *values: Any) -> bytes:
    """Return a request with these values, one for each field of its layout."""
    message = _BY_NAME[name]
    payload = message.head.pack(*values)
    return bytes((FRAME, message.code, 1, len(payload))) + payload


def convert(sensors: int, times: int, period_us: int) -> bytes:
    """Return an input that makes the sensors in the mask convert `times` times."""
    return bytes((CONVERT, sensors, 7, times, period_us // 50))


def zeros(message: Message) -> bytes:
    """Return a request of zeros."""
    return bytes((FRAME, message.code, 1, message.head.size)) + bytes(message.head.size)


def setup(range_g: float) -> bytes:
    """Return the requests that set up all sensors."""
    gyroscopes = (frame("configure", sensor, 200.0, 100.0, range_g, 0.0) for sensor in range(len(GYROSCOPES)))
    magnetometers = (
        frame("configure", sensor, 80.0, 0.0, 0.0, 4.0) for sensor in range(len(GYROSCOPES), len(BOARD_PARTS))
    )
    return b"".join((*gyroscopes, *magnetometers))


SETUP = setup(0.0)
GYROSCOPE_MASK = (1 << len(GYROSCOPES)) - 1
CONSTANT = (1, b"LSM9DS1-001", 1_700_000_000, 25.0, 1.1, 0.0, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 1.3, 0.01, -0.02, 0.03)
RECORD = (*CONSTANT, 0.0, 50.0, *9 * (1e-7,), *9 * (-1e-7,))
OBSERVATIONS = b"".join(
    frame("recall", 0, index, *(speed_rad_s * (i == index // 2) + 0.01 for i in range(3)), abs(speed_rad_s))
    for index, speed_rad_s in enumerate((0.5, -0.5, 0.5, -0.5, 0.5, -0.5))
)
SESSIONS = {
    "requests": b"".join(zeros(message) for message in MESSAGES if message.sender == "host"),
    "stream": SETUP
    + frame("start", 0)
    + convert((1 << len(BOARD_PARTS)) - 1, 120, 4000)
    + frame("status")
    + frame("stop"),
    "accelerations": setup(8.0)
    + frame("start", 0)
    + convert(GYROSCOPE_MASK, 120, 4000)
    + frame("status")
    + frame("stop"),
    "heated": SETUP
    + frame("start", 0)
    + convert(GYROSCOPE_MASK, 60, 4000)
    + frame("heat", 200)
    + bytes((WAIT, 255, 4)),
    "kept": SETUP
    + frame("keep", GYROSCOPE_MASK, 0.5)
    + frame("start", 0)
    + convert(GYROSCOPE_MASK, 250, 4000)
    + frame("observe", 0, 0, 200_000, 400_000, 0.5),
    "solved": SETUP + OBSERVATIONS + frame("solve", 0, 0) + frame("solve", 0, 1),
    "stored": SETUP
    + frame("write_calibration", 0, *RECORD)
    + frame("read_calibration", 0)
    + frame("start", 1)
    + convert(1, 60, 4000)
    + frame("stop")
    + frame("erase_calibration", 0),
    "power cut": SETUP + bytes((FLASH, 9)) + frame("write_calibration", 0, *RECORD) + frame("read_calibration", 0),
    "broken parts": bytes((DISTURB, 0, 0x0F, 0xFF))
    + SETUP
    + bytes((DISTURB, 2, 0x93, 1))
    + convert(GYROSCOPE_MASK, 40, 4000),
    "silence": SETUP + frame("start", 0) + bytes((WAIT, 255, 4)) + frame("reboot"),
    "busy line": SETUP + frame("start", 0) + bytes((LINE, 1)) + convert(GYROSCOPE_MASK, 200, 4000) + bytes((LINE, 0)),
    "too much noise": 2 * (bytes((NOISE, 255)) + bytes(range(1, 256))) + bytes((NOISE, 1, 0)),
    "noise": bytes((NOISE, 200)) + bytes(range(1, 201)) + bytes((NOISE, 1, 0)) + zeros(_BY_NAME["hello"]),
}


def main(folder: Path) -> None:
    """Write one file for each session."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, session in SESSIONS.items():
        (folder / name.replace(" ", "_")).write_bytes(session)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
