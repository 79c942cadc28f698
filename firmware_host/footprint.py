"""The image's use of the chip: `python -m firmware_host.footprint`, which `make firmware` runs after the build.

The use of flash and RAM is read from the linker's output. The use of the stack is the board's own report after a
session on the emulator with all its functions: all gyroscopes streaming with accelerations, and a magnetometer,
observations stored and averaged, both solutions, a move by hand solved, the heater on, a calibration over temperature
written, read, applied to a stream and erased.
"""

import io
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile

from firmware_host.emulator.chip.flash_memory import FlashMemory
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.parts.gyroscope import GyroTruth
from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.parts import BOARD_PARTS, GYROSCOPES, MAGNETOMETERS
from firmware_host.protocol import METHODS

IMAGE = Path(__file__).parent / "firmware" / "image"
FLASH_LIMIT_BYTES = 40 * 1024  # of the 224 KB for the image
RAM_LIMIT_BYTES = 40 * 1024  # of the 48 KB for the image
RANGE_G = 8.0  # a range of every gyroscope's accelerometer
RAM = range(0x2000_0000, 0x2000_C000)
RATE_HZ, RANGE_DEG_S = 200.0, 100.0  # the parts' nearest rate, their smallest range that has it
SENSORS = range(len(GYROSCOPES))  # the board's first
ALL_SENSORS = (1 << len(GYROSCOPES)) - 1  # a mask of them
DIRECTIONS = ((0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
NO_ROTATION = (0, 0, 0)
REST_S = 1.4  # the board needs a second for a rest
SPEED_RAD_S = 1.5  # within that range for the scale of every part
STEP_S = 0.01
MAX_ANSWER_STEPS = 10


class Session:
    """A board with all its sensors, which rotate about `direction`."""

    def __init__(self, image: bytes, elf: bytes) -> None:
        self.direction: tuple[float, ...] = DIRECTIONS[0]
        truth = GyroTruth((1.1, 0.9, 1.2), (0.01, -0.02, 0.03), noise_rad_s=0.01)
        self._board = EmulatedBoard(
            flash=FlashMemory(image),
            elf=elf,
            devices=[
                *(
                    part.register_model(self._rate_at, truth, temperature_c=25.0, seed=1)
                    for part in GYROSCOPES.values()
                ),
                *(
                    part.register_model(lambda _time_s: (0.0, 0.0, 50e-6), MagnetometerTruth(), seed=1)
                    for part in MAGNETOMETERS.values()
                ),
            ],
            unique_id=bytes(12),
            crystal_ppm=0.0,
            boot_time_s=0.0,
        )
        self._reader = FrameReader()
        self._steps = 0
        self.run(0.1)

    def _rate_at(self, _time_s: float) -> tuple[float, ...]:
        return tuple(SPEED_RAD_S * part for part in self.direction)

    def run(self, duration_s: float) -> list[Frame]:
        """Advance the time by `duration_s`, s; return the frames that the board sent."""
        frames = []
        for _ in range(math.ceil(duration_s / STEP_S)):
            self._steps += 1
            self._board.advance(self._steps * STEP_S)
            frames.extend(self._reader.feed(self._board.take_sent()))
        return frames

    def ask(self, name: str, **values: Any) -> dict[str, Any]:
        """Send a request and return the answer's fields. Raise RuntimeError if the board refuses or does not answer."""
        self._board.receive(encode(name, 9, values))
        for _ in range(MAX_ANSWER_STEPS):
            for frame in self.run(STEP_S):
                if frame.values.get("reply_to") != 9:
                    continue
                if frame.name == "error":
                    raise RuntimeError(f"the board refuses {name}: {frame.values}")
                return frame.values
        raise RuntimeError(f"the board does not answer {name}")

    def sweep(self, index: int) -> None:
        """Make one sweep: store, rotate, and have the board observe every sensor."""
        self.direction = DIRECTIONS[index]
        self.run(0.1)
        self.ask("keep", sensors=ALL_SENSORS, duration_s=1.0)
        start_us = self.ask("status")["uptime_us"]
        self.run(0.2)
        end_us = self.ask("status")["uptime_us"]
        self.run(0.1)
        span = {"start_us": start_us, "end_us": end_us, "speed_rad_s": SPEED_RAD_S}
        for sensor in SENSORS:
            self.ask("observe", sensor=sensor, index=index, **span)

    def turn_by_hand(self) -> None:
        """Rotate by a whole revolution from rest to rest. Raise RuntimeError if the board does not take the move."""
        self.ask("by_hand", sensor=0, moves=1, scale_std=1.0)
        for direction, duration_s in (
            (NO_ROTATION, REST_S),
            (DIRECTIONS[0], 2 * math.pi / SPEED_RAD_S),
            (NO_ROTATION, REST_S),
        ):
            self.direction = direction
            self.run(duration_s)
        if (solution := self.ask("hand_solve"))["accepted"] != 1:
            raise RuntimeError(f"the board has not taken the move: {solution}")


def measure_stack(image: bytes, elf: bytes) -> int:
    """Return the most stack, bytes, that the board reports after a session of all its tasks."""
    session = Session(image, elf)
    for sensor in SENSORS:
        ranges = {"range_deg_s": RANGE_DEG_S, "range_g": RANGE_G, "range_gauss": 0.0}
        session.ask("configure", sensor=sensor, rate_hz=RATE_HZ, **ranges)
    for sensor in range(len(GYROSCOPES), len(BOARD_PARTS)):
        ranges = {"range_deg_s": 0.0, "range_g": 0.0, "range_gauss": 4.0}
        session.ask("configure", sensor=sensor, rate_hz=80.0, **ranges)
    session.ask("start", sensors=0)
    session.run(0.5)
    session.ask("heat", power=255)
    for index in range(len(DIRECTIONS)):
        session.sweep(index)
    solutions = [session.ask("solve", sensor=s, method=m) for s in SENSORS for m in range(len(METHODS))]
    if any(solution["status"] for solution in solutions):
        raise RuntimeError(f"the board has not solved: {solutions}")
    session.turn_by_hand()
    session.ask("stop")
    for sensor in SENSORS:
        solution = solutions[len(METHODS) * sensor]
        values = {"matrix": np.diag(solution["scale"]), "bias_rad_s": solution["bias_rad_s"]}
        header = {"model": 1, "serial_number": "footprint", "written_unix_s": 0, "temperature_c": 25.0}
        polynomials = dict.fromkeys(("scale_change", "bias_change_rad_s"), np.full((3, 3), 1e-7))
        session.ask("write_calibration", sensor=sensor, **header, **values, **polynomials, lowest_c=0.0, highest_c=50.0)
        session.ask("read_calibration", sensor=sensor)
    session.ask("start", sensors=ALL_SENSORS)
    session.run(0.5)
    session.ask("stop")
    for sensor in SENSORS:
        session.ask("erase_calibration", sensor=sensor)
    return int(session.ask("status")["stack_high_water"])


def read_ram_sizes(elf: bytes) -> tuple[int, int]:
    """Return the RAM that the linker allocated, and the part of this for the stack, bytes."""
    sections = [s for s in ELFFile(io.BytesIO(elf)).iter_sections() if s["sh_flags"] & SH_FLAGS.SHF_ALLOC]
    in_ram = {section.name: int(section["sh_size"]) for section in sections if section["sh_addr"] in RAM}
    return sum(in_ram.values()), in_ram[".stack"]


def main() -> int:
    """Print the use of flash, RAM and stack. Return 1 if one exceeds its limit."""
    image, elf = (IMAGE / "rig_l432.bin").read_bytes(), (IMAGE / "rig_l432.elf").read_bytes()
    ram, room = read_ram_sizes(elf)
    stack = measure_stack(image, elf)
    print(f"flash {len(image):6} B of {FLASH_LIMIT_BYTES}")
    print(f"RAM   {ram:6} B of {RAM_LIMIT_BYTES}, {room} of them for the stack")
    print(f"stack {stack:6} B of {room} at most, as the board reports after a session of everything")
    return 0 if len(image) < FLASH_LIMIT_BYTES and ram < RAM_LIMIT_BYTES and stack < room else 1


if __name__ == "__main__":
    sys.exit(main())
