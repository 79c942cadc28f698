"""Simulated servos at a port, in a process of their own, with the faults that a driver can meet."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from rig.world.servo.bus import SimulatedBus
from rig.world.servo.servo import SimulatedServo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.servo.wire_format import REBOOT, WRITE, ServoPacket
from support.processes.forked import find_fork_server
from support.processes.yoked_clock import YokedClock
from support.wires.bus_on_a_line import BusOnALine

# As a servo is that is set up for the rig: 1 Mbit/s, no return delay, extended position mode, time-based profile.
SET_UP: dict[str, int] = {"Baud Rate": 3, "Return Delay Time": 0, "Operating Mode": 4, "Drive Mode": 4}
PLAIN = LineTruth()
BAUD = 1_000_000  # the driver's
LINE = "servo"  # the driver's thread that has the line


class _FarEnd:
    """The simulated servos in the other process, with their actions."""

    def __init__(self, clock: YokedClock, truths: tuple[ServoTruth, ...], line: LineTruth, pty: bool) -> None:
        self._now = clock.time_s

        def bus(now: Callable[[], float]) -> SimulatedBus:
            return SimulatedBus([SimulatedServo(truth, now()) for truth in truths], line, now, seed=7)

        self.far = BusOnALine(bus, self._now, clock.move_on, pty=pty)
        self.far.line.host_baud = None if pty else BAUD

    @property
    def servo(self) -> SimulatedServo:
        return self.far.bus.servos[0]

    def port(self) -> str:
        return self.far.port

    def angle_rad(self) -> float:
        return self.servo.angle_at(self._now())

    def rate_rad_s(self) -> float:
        return self.servo.rate_at(self._now())

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
        self.servo.switch_supply(on, self._now())

    def let_go(self) -> None:
        """Switch torque off, as another program would."""
        self.servo.obey(ServoPacket(1, WRITE, b"\x40\0\0", True), self._now())

    def trip(self) -> None:
        """Let the watchdog run out."""
        self.servo.drive.trip(self._now())

    def reboot(self) -> None:
        """Restart the servo, as another program would."""
        self.servo.obey(ServoPacket(1, REBOOT, b"", True), self._now())

    def add(self, truth: ServoTruth) -> None:
        """Plug in another servo."""
        self.far.bus.servos = [*self.far.bus.servos, SimulatedServo(truth, self._now())]

    def pull_out(self) -> None:
        self.far.pull_out()


def _serve(pipe: "Connection[Any, Any]", clock: YokedClock) -> None:
    """Serve one request for a far end after the other."""
    end: _FarEnd | None = None
    with suppress(EOFError, OSError):
        while True:
            while pipe.poll(0.0 if end is not None else None):
                name, arguments = pipe.recv()
                if name == "begin":
                    end = _FarEnd(clock, *arguments)
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
    """The process of all far ends, because starting a process for each would take most of a test's time."""

    def __init__(self) -> None:
        context = find_fork_server()
        self.pipe, far = context.Pipe()
        self.clock = YokedClock(LINE)
        self.process = context.Process(target=_serve, args=(far, self.clock), daemon=True)
        self.process.start()
        far.close()


_PROCESS: list[_Process] = []  # one, as soon as it is needed


class ServoOnAWire:
    """The servo at `port`, and the clock that it shares with its driver."""

    def __init__(self, truths: tuple[ServoTruth, ...], line: LineTruth, *, pty: bool) -> None:
        if not _PROCESS or not _PROCESS[0].process.is_alive():
            _PROCESS[:] = [_Process()]
        self._pipe, self.clock = _PROCESS[0].pipe, _PROCESS[0].clock
        self.clock.begin()
        self.port: str = self.do("begin", truths, line, pty)

    def do(self, name: str, *arguments: object) -> Any:
        """Let the far end execute an action; return its answer."""
        self._pipe.send((name, arguments))
        return self._pipe.recv()

    @property
    def angle_rad(self) -> float:
        value: float = self.do("angle_rad")
        return value

    @property
    def rate_rad_s(self) -> float:
        value: float = self.do("rate_rad_s")
        return value

    def close(self) -> None:
        self.do("end")


@contextmanager
def servo_on_a_wire(*truths: ServoTruth, line: LineTruth = PLAIN, pty: bool = False) -> Iterator[ServoOnAWire]:
    """Run servos during the `with` block, by default one that is set up for the rig.

    Its port is a pseudo-terminal (`pty`), or one at socket://, which carries no baud rate: the host's is `BAUD`.
    """
    wire = ServoOnAWire(truths or (ServoTruth(settings=SET_UP),), line, pty=pty)
    try:
        yield wire
    finally:
        wire.close()
