"""The maker's packet handler as this driver uses it: a reply, or an exception that says what was wrong with it."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rig.errors import Problem, Refused
from rig.errors.extras import missing_extra
from rig.turners.servo.clock import HOST, Clock
from rig.turners.servo.latency import lower_latency
from rig.turners.servo.port import Port
from rig.turners.servo.registers import RETURN_LEVEL, Register

# What a port that is pulled out raises: pyserial's own error is an OSError, and closed meanwhile it says TypeError.
FAILURES: tuple[type[Exception], ...] = (OSError, TypeError)
with suppress(ImportError):  # on Windows
    import termios

    FAILURES = (*FAILURES, termios.error)
SLACK_S = 0.020  # return delay (0.5 ms as delivered), latency of the adapter, and a busy host
SETTLE_MOST_S = 0.1  # a line that never falls silent is not waited for any longer
ATTEMPTS = 4  # a write whose acknowledgement is lost is looked up, and sent again if it is not there
ALERT = 0x80  # in the error byte: Hardware Error Status is not zero. A flag, no failure of the instruction
SUCCESS, NOT_SENT = 0, (-1000, -1001, -2000)  # results of the packet handler: port busy, not sent, wrong instruction
DAMAGED = -3002


class BusError(Exception):
    """Something between this computer and the servo."""


class Lost(BusError):
    """No usable reply; `damaged` when something came that was none."""

    def __init__(self, damaged: bool) -> None:
        super().__init__("a damaged reply" if damaged else "no reply")
        self.damaged = damaged


class Denied(BusError):
    """The servo's no to an instruction, by the error number of protocol 2.0."""

    def __init__(self, number: int, register: Register) -> None:
        super().__init__(f"error {number} at {register.name}")
        self.number = number


class PortGone(BusError):
    """A port that has failed. It stays so: another `Bus` may try it again."""


class Bus:
    """The line to one servo. Only one thread at a time may use it."""

    def __init__(self, path: str, baud: int, servo_id: int, clock: Clock = HOST) -> None:
        """Opens and locks the port. Raises Refused `missing_extra`, `servo_port_in_use`, `no_servo_port`, …."""
        try:
            from dynamixel_sdk import PacketHandler
        except ImportError as error:
            raise missing_extra(error, "servo") from error
        self._id, self._path, self.clock = servo_id, path, clock
        self._packets: Any = PacketHandler(2.0)
        self._gone = False
        self.alert = False  # of the newest reply
        try:
            self._port = Port(path, baud, SLACK_S, clock)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise Refused.of(_no_port(path, baud, error)) from error
        try:
            lower_latency(self._port.serial, path)
        except BaseException:
            self._port.close()
            raise

    def close(self) -> None:
        """Give the port back."""
        self._gone = True
        self._port.close()

    def ping(self) -> int:
        """The model number. Raises Lost, PortGone."""
        with self._failing():
            number, result, error = self._packets.ping(self._port, self._id)
        self._judge(result, error, RETURN_LEVEL)
        return int(number)

    def more_came(self, wait_s: float) -> bool:
        """Whether anything follows within `wait_s` that nobody asked for."""
        with self._failing():
            for _ in range(max(1, round(wait_s / 0.002))):
                if self._port.readPort(1):
                    return True
        return False

    def read(self, register: Register) -> tuple[int, ...]:
        """A register's values. Raises Lost, Denied, PortGone."""
        return register.unpack(self.read_bytes(register))

    def read_bytes(self, register: Register) -> bytes:
        """A register's bytes. Raises Lost, Denied, PortGone."""
        with self._failing():
            data, result, error = self._packets.readTxRx(self._port, self._id, register.address, register.size)
        self._judge(result, error, register)
        if len(data) != register.size:  # the late reply to another question
            raise Lost(damaged=True)
        return bytes(data)

    def look_up(self, register: Register) -> tuple[int, ...]:
        """What a register holds, asked again where a reply is lost. Raises Lost, Denied, PortGone."""
        for _ in range(ATTEMPTS - 1):
            try:
                return self.read(register)
            except Lost:
                self.settle()
        return self.read(register)

    def write(self, register: Register, *values: int) -> None:
        """Write values, all of them absolute, so that it does no harm to write them twice.

        When no acknowledgement comes, the register is read: an instruction that was lost is sent again. Raises Lost,
        Denied, PortGone.
        """
        data = register.pack(*values)
        for attempt in range(ATTEMPTS):
            try:
                with self._failing():
                    result, error = self._packets.writeTxRx(
                        self._port, self._id, register.address, register.size, list(data)
                    )
                self._judge(result, error, register)
                return
            except Lost:
                self.settle()
                if attempt == ATTEMPTS - 1:
                    raise
                try:
                    if self.read_bytes(register) == data:
                        return
                except Lost:
                    self.settle()

    def write_unheard(self, register: Register, *values: int) -> None:
        """Write values to a servo that does not acknowledge. Raises PortGone."""
        with self._failing():
            data = list(register.pack(*values))
            self._packets.writeTxOnly(self._port, self._id, register.address, register.size, data)

    def settle(self) -> None:
        """Wait until nothing has come for `SLACK_S`, so that a late reply is not taken for the next. Raises PortGone.

        Replies do not say which instruction they answer.
        """
        with self._failing():
            now_s = self.clock.now_s()
            quiet_s, give_up_s = now_s + SLACK_S, now_s + SETTLE_MOST_S
            while (now_s := self.clock.now_s()) < min(quiet_s, give_up_s):
                if self._port.readPort(1024):
                    quiet_s = now_s + SLACK_S

    def _judge(self, result: int, error: int, register: Register) -> None:
        if result in NOT_SENT:
            raise PortGone(f"the packet handler gives {result}")
        if result != SUCCESS:
            raise Lost(damaged=result == DAMAGED)
        self.alert = bool(error & ALERT)
        if error & ~ALERT:
            raise Denied(error & ~ALERT, register)

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """What the packet handler may raise, by its names here."""
        if self._gone:
            raise PortGone("it has been closed")
        try:
            yield
        except IndexError as error:  # it reads on in a reply that is too short
            self._port.is_using = False
            raise Lost(damaged=True) from error
        except FAILURES as error:
            self._gone = True
            raise PortGone(str(error)) from error


def _no_port(path: str, baud: int, error: Exception) -> Problem:
    if "exclusively lock" in str(error) or getattr(error, "errno", None) == 16:  # EBUSY
        return Problem(
            "servo_port_in_use", f"another program has the servo's port {path}", "End that program, then start again"
        )
    return Problem(
        "no_servo_port",
        f"the servo's port {path} does not open at {baud} baud: {error}",
        "Check turner.port, the adapter and its cable, and whether you may use serial ports (group dialout)",
    )
