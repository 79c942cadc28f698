"""A laboratory without sockets, and a host that asks its board in process, tick by tick."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.parts import GYROSCOPES
from rig.config.load import Loaded
from rig.world.board.serial_line import SerialLine
from rig.world.laboratory import Laboratory
from rig.world.world_section import read_world_section

SENSORS = tuple(GYROSCOPES)  # the board's table


@dataclass
class Host:
    """A host driven tick by tick, which asks the board in process, so that the time of every byte is determined."""

    laboratory: Laboratory
    line: SerialLine
    received: bytearray

    def ask(self, name: str, sequence: int, values: dict[str, Any] | None = None) -> None:
        self.line.send_to_device(encode(name, sequence, values), None)

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.laboratory.step()
            self.line.tick()
            self.received += self.line.read_as_host(None)

    def samples(self, sensor: int = 0) -> np.ndarray:
        """Return the counts (n, 3) of all samples of one sensor received so far."""
        frames = FrameReader().feed(bytes(self.received))
        samples = [frame for frame in frames if frame.name == "samples"]
        return np.concatenate([frame.items["counts"] for frame in samples if frame.values["sensor"] == sensor])

    def answer(self, name: str, values: dict[str, Any]) -> Frame:
        """Send a request, and wait for the answer."""
        self.received.clear()
        self.ask(name, 99, values)
        self.ticks(100)
        frames = FrameReader().feed(bytes(self.received))
        (answer,) = [frame for frame in frames if frame.values.get("reply_to") == 99]
        return answer


def boot(loaded: Loaded) -> Host:
    """Return a laboratory whose board has started."""
    laboratory = Laboratory(loaded.config, read_world_section(loaded))
    new = Host(laboratory, SerialLine(lambda: laboratory.board), bytearray())
    new.ticks(200)
    return new


def host(loaded: Loaded) -> Host:
    """Return a laboratory whose board streams all its sensors."""
    new = boot(loaded)
    for sensor in loaded.config.sensors.values():
        index = SENSORS.index(sensor.part)
        settings = {"sensor": index, "rate_hz": sensor.rate_hz, "range_deg_s": sensor.range_deg_s}
        settings |= {"range_g": 0, "range_gauss": 0}
        new.ask("configure", 1, settings)
        new.ticks(20)
    new.ask("start", 2, {"sensors": 0})
    new.ticks(20)
    return new
