"""Simulated servos on a pseudo-terminal, in a process of their own: what the driver has before it, and its faults."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from rig.world.servo.bus import Bus
from rig.world.servo.servo import Servo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.servo.wire_format import REBOOT, WRITE, Packet
from support.bus_on_a_pty import BusOnAPty
from support.forked import forked

# As a servo is that is set up for the rig: 1 Mbit/s, no return delay, extended position mode, time-based profile.
SET_UP: dict[str, int] = {"Baud Rate": 3, "Return Delay Time": 0, "Operating Mode": 4, "Drive Mode": 4}
PLAIN = LineTruth()


class _FarEnd:
    """What the far process does when it is asked."""

    def __init__(self, truths: tuple[ServoTruth, ...], line: LineTruth) -> None:
        self.far = BusOnAPty(lambda now: Bus([Servo(each, now()) for each in truths], line, now, seed=7))

    @property
    def servo(self) -> Servo:
        return self.far.bus.servos[0]

    def port(self) -> str:
        return self.far.port

    def angle_rad(self) -> float:
        return self.servo.angle_at(time.monotonic())

    def rate_rad_s(self) -> float:
        return self.servo.rate_at(time.monotonic())

    def register(self, name: str) -> int:
        return self.servo.memory[name]

    def put(self, name: str, value: int) -> None:
        self.servo.memory[name] = value

    def fault(self, name: str, value: object) -> None:
        setattr(self.servo.faults, name, value)

    def of_line(self, name: str, value: object) -> None:
        setattr(self.far.line, name, value)

    def of_bus(self, name: str, value: object) -> None:
        setattr(self.far.bus, name, value)

    def switch(self, on: bool) -> None:
        self.servo.switch(on, time.monotonic())

    def let_go(self) -> None:
        """Somebody else switches torque off."""
        self.servo.obey(Packet(1, WRITE, b"\x40\0\0", True), time.monotonic())

    def trip(self) -> None:
        """Let the watchdog run out."""
        self.servo.drive.trip(time.monotonic())

    def reboot(self) -> None:
        """Somebody else starts it anew."""
        self.servo.obey(Packet(1, REBOOT, b"", True), time.monotonic())

    def add(self, truth: ServoTruth) -> None:
        """Another servo is plugged in."""
        self.far.bus.servos = [*self.far.bus.servos, Servo(truth, time.monotonic())]

    def pull_out(self) -> None:
        self.far.pull_out()


def _serve(pipe: "Connection[Any, Any]") -> None:
    """Be one far end after the other, as they are asked for."""
    end: _FarEnd | None = None
    with suppress(EOFError, OSError):
        while True:
            while pipe.poll(0.0 if end is not None else None):
                name, arguments = pipe.recv()
                if name == "begin":
                    end = _FarEnd(*arguments)
                    pipe.send(end.port())
                elif name == "end" and end is not None:
                    end.far.close()
                    end = None
                    pipe.send(None)
                else:
                    pipe.send(getattr(end, name)(*arguments))
            if end is not None:
                end.far.live(0.004)


class _Process:
    """The process of all far ends of this one: to begin a process for each would take most of a test's time."""

    def __init__(self) -> None:
        context = forked()
        self.pipe, far = context.Pipe()
        self.process = context.Process(target=_serve, args=(far,), daemon=True)
        self.process.start()
        far.close()


_PROCESS: list[_Process] = []  # one, as soon as it is needed


class ServoOnAWire:
    """The servo at `port`."""

    def __init__(self, truths: tuple[ServoTruth, ...], line: LineTruth) -> None:
        if not _PROCESS or not _PROCESS[0].process.is_alive():
            _PROCESS[:] = [_Process()]
        self._pipe = _PROCESS[0].pipe
        self.port: str = self.do("begin", truths, line)

    def do(self, name: str, *arguments: object) -> Any:
        """Let the far end do something; its answer."""
        self._pipe.send((name, arguments))
        return self._pipe.recv()

    @property
    def angle_rad(self) -> float:
        found: float = self.do("angle_rad")
        return found

    @property
    def rate_rad_s(self) -> float:
        found: float = self.do("rate_rad_s")
        return found

    def close(self) -> None:
        self.do("end")


@contextmanager
def servo_on_a_wire(*truths: ServoTruth, line: LineTruth = PLAIN) -> Iterator[ServoOnAWire]:
    """For the length of the `with` block; one that is set up for the rig where no truth is given."""
    wire = ServoOnAWire(truths or (ServoTruth(left=SET_UP),), line)
    try:
        yield wire
    finally:
        wire.close()
