"""The maker's packet handler with exceptions: every call returns a valid reply or raises the reason."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rig.errors import Problem, Refused
from rig.errors.extras import requiring
from rig.turners.servo.driver_clock import HOST, Clock
from rig.turners.servo.latency import lower_latency
from rig.turners.servo.servo_port import READ_WAIT_S, Port
from rig.turners.servo.servo_registers import RETURN_LEVEL, Register

# The errors of an unplugged port: pyserial's own is an OSError; a port closed meanwhile raises TypeError.
PORT_ERRORS: list[type[Exception]] = [OSError, TypeError]
with suppress(ImportError):  # on Windows
    import termios

    PORT_ERRORS.append(termios.error)
TIMEOUT_MARGIN_S = 0.020  # return delay (0.5 ms as delivered), latency of the adapter, and delays of a busy host
MAX_SETTLING_S = 0.1  # for a line to fall silent
MAX_ATTEMPTS = 4  # a write without acknowledgement is read back, and repeated if it did not take effect
ALERT_BIT = 0x80  # of the error byte: Hardware Error Status is not zero. The instruction itself has not failed
SUCCESS, NOT_SENT = 0, (-1000, -1001, -2000)  # not sent: port busy, failed, wrong instruction
DAMAGED_PACKET = -3002
ID, LENGTH, ERROR, DATA = 4, 5, 8, 9  # indices in a status packet of protocol 2.0
EMPTY_LENGTH = 4  # of a status packet without data: instruction, error, checksum


class BusError(Exception):
    """An error in the exchange between this computer and the servo."""


class ReplyLost(BusError):
    """The loss of a reply, which did not arrive or, if `damaged`, arrived damaged."""

    def __init__(self, damaged: bool) -> None:
        super().__init__("a damaged reply" if damaged else "no reply")
        self.damaged = damaged


class InstructionDenied(BusError):
    """The servo's refusal of an instruction, with the error number of protocol 2.0."""

    def __init__(self, number: int, register: Register) -> None:
        super().__init__(f"error {number} at {register.name}")
        self.number = number


class PortGone(BusError):
    """A failed port. The bus is unusable; another `Bus` may open the port again."""


class Bus:
    """The line to one servo, for one thread at a time."""

    def __init__(self, path: str, baud: int, servo_id: int, clock: Clock = HOST) -> None:
        """Open the port. Raise Refused `missing_extra`, `servo_port_in_use`, `no_servo_port`, `servo_adapter_slow`."""
        with requiring("servo"):
            from dynamixel_sdk import PacketHandler
        self._id, self._path, self.clock = servo_id, path, clock
        self._packets: Any = PacketHandler(2.0)
        self._gone = False
        self.alert = False  # flag of the newest reply
        try:
            self._port = Port(path, baud, TIMEOUT_MARGIN_S, clock)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise Refused.from_problem(_no_port(path, baud, error)) from error
        try:
            lower_latency(self._port.serial, path)
        except BaseException:
            self._port.close()
            raise

    def close(self) -> None:
        """Close the port."""
        self._gone = True
        self._port.close()

    def ping(self) -> int:
        """Return the model number. Raise ReplyLost, PortGone."""
        with self._failing():
            number, result, error = self._packets.ping(self._port, self._id)
        self._judge(result, error, RETURN_LEVEL)
        return int(number)

    def more_came(self, wait_s: float) -> bool:
        """Return whether another byte arrives within `wait_s`, although nothing was requested."""
        with self._failing():
            for _ in range(max(1, round(wait_s / READ_WAIT_S))):
                if self._port.readPort(1):
                    return True
        return False

    def read(self, register: Register) -> tuple[int, ...]:
        """Return a register's values. Raise ReplyLost, InstructionDenied, PortGone."""
        return register.unpack(self.read_bytes(register))

    def read_bytes(self, register: Register) -> bytes:
        """Return a register's bytes. Raise ReplyLost, InstructionDenied, PortGone.

        The packet handler's `readTxRx` is not used, because it takes the requested number of bytes from a reply of any
        length, and so would take the checksum of a late acknowledgement for data.
        """
        with self._failing():
            result = self._packets.readTx(self._port, self._id, register.address, register.size)
            reply: list[int] = []
            while result == SUCCESS and (not reply or reply[ID] != self._id):
                reply, result = self._packets.rxPacket(self._port, False)
        self._judge(result, reply[ERROR] if result == SUCCESS else 0, register)
        if reply[LENGTH] + 256 * reply[LENGTH + 1] != register.size + EMPTY_LENGTH:  # a late reply to another request
            raise ReplyLost(damaged=True)
        return bytes(reply[DATA : DATA + register.size])

    def look_up(self, register: Register) -> tuple[int, ...]:
        """Return a register's values. A request whose reply is lost is repeated.

        Raise ReplyLost, InstructionDenied, PortGone.
        """
        for _ in range(MAX_ATTEMPTS - 1):
            try:
                return self.read(register)
            except ReplyLost:
                self.settle()
        return self.read(register)

    def write(self, register: Register, *values: int) -> None:
        """Write absolute values, so that a repeated write does no harm.

        If the acknowledgement is lost, read the register, and write again unless it has the values. Raise ReplyLost,
        InstructionDenied, PortGone.
        """
        data = register.pack(*values)
        for attempt in range(MAX_ATTEMPTS):
            try:
                with self._failing():
                    result, error = self._packets.writeTxRx(
                        self._port, self._id, register.address, register.size, list(data)
                    )
                self._judge(result, error, register)
                return
            except ReplyLost:
                self.settle()
                if attempt == MAX_ATTEMPTS - 1:
                    raise
                try:
                    if self.read_bytes(register) == data:
                        return
                except ReplyLost:
                    self.settle()

    def write_unheard(self, register: Register, *values: int) -> None:
        """Write values without waiting for an acknowledgement. Raise PortGone."""
        with self._failing():
            data = list(register.pack(*values))
            self._packets.writeTxOnly(self._port, self._id, register.address, register.size, data)

    def settle(self) -> None:
        """Wait until the line has been silent for `TIMEOUT_MARGIN_S`.

        Replies do not name their instruction, so a late reply would be taken for the next one. Raise PortGone.
        """
        with self._failing():
            now_s = self.clock.now_s()
            quiet_s, give_up_s = now_s + TIMEOUT_MARGIN_S, now_s + MAX_SETTLING_S
            while (now_s := self.clock.now_s()) < min(quiet_s, give_up_s):
                if self._port.readPort(1024):
                    quiet_s = now_s + TIMEOUT_MARGIN_S

    def _judge(self, result: int, error: int, register: Register) -> None:
        if result in NOT_SENT:
            raise PortGone(f"the packet handler gives {result}")
        if result != SUCCESS:
            raise ReplyLost(damaged=result == DAMAGED_PACKET)
        self.alert = bool(error & ALERT_BIT)
        if error & ~ALERT_BIT:
            raise InstructionDenied(error & ~ALERT_BIT, register)

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """Translate the exceptions of the packet handler into ReplyLost and PortGone."""
        if self._gone:
            raise PortGone("it has been closed")
        try:
            yield
        except IndexError as error:  # the packet handler reads beyond a reply that is too short
            self._port.is_using = False
            raise ReplyLost(damaged=True) from error
        except tuple(PORT_ERRORS) as error:
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
