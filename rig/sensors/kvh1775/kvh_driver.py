"""The host end of a KVH 1775's line: a thread that reads, a dialogue in configuration mode, a stream in normal mode.

The same driver talks to the instrument over RS-422 and to the simulated one, as bytes on a port.
"""

import re
from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_messages import BuiltInTest, MessageReader
from rig.sensors.kvh1775.kvh_settings import NAMES, Kvh1775Settings, same
from rig.sensors.kvh1775.message_numbering import MessageCounter
from rig.sensors.own_port import OwnPort, PortFaults, closing_on_failure, open_device_port
from rig.sensors.port_silence import MAX_ATTEMPTS, PATIENCE, Patience

KEPT_BYTES = 4096  # bytes of the input that are searched for an answer
_CABLE = "Check its supply and cable, and whether another program has the port"

# Messages (n,) MESSAGE_DTYPE, their numbers (n,) from 0, their times (n,) in µs, and the time of the read.
OnMessages = Callable[[NDArray[Any], NDArray[Any], NDArray[Any], float], None]


class Kvh1775:
    """The instrument on a serial port or `socket://host:port`, which stays open until `close`.

    A thread reads the port and calls `on_messages`. Errors are SensorErrors with names that begin with `kvh_`; their
    messages name the configured `sensor`.
    """

    def __init__(
        self, sensor: str, port: str, baud: int, on_messages: OnMessages | None = None, *, patience: Patience = PATIENCE
    ) -> None:
        """Open the port, end a stream that may be running, and read serial number and settings.

        Raise SensorError `no_port`, `no_kvh`, `kvh_wrong_baud_rate`, `kvh_does_not_hear`, `kvh_command_refused`.
        """
        self._sensor, self.port, self._baud = sensor, port, baud
        self._where = f"sensors.{sensor}: the KVH 1775 on {port}"
        self._on_messages, self._patience = on_messages, patience
        self._messages = MessageReader()
        self._byte_count = self._message_count = 0
        self._tests: list[BuiltInTest] = []
        self._counter: MessageCounter | None = None  # while it streams
        self._format = b""
        self._received = bytearray()
        no_message = f"sensors.{sensor}: no complete message from the KVH 1775 on {port}"
        faults = PortFaults(
            closed=SensorError("kvh_link_lost", f"sensors.{sensor}: the port {port} closed", _CABLE),
            silent=SensorError("kvh_link_lost", no_message, _CABLE),
            not_taken=SensorError("kvh_not_taken", f"sensors.{sensor}", "See the run's log"),
        )
        serial = open_device_port(port, baud, owner=f"sensors.{sensor}: ", setting="serial.port")
        self.own_port = OwnPort(serial, port, faults, self._take, patience=patience, farewell=self._leave_configuration)
        self.own_port.begin()
        with closing_on_failure(self.close):
            self._enter_configuration()
            self.serial_number = self._ask("?IS", "IS")
            self.settings = {name: self._ask(f"?{name}", name) for name in NAMES}

    def correct(self, settings: dict[str, str]) -> None:
        """Change settings in the instrument's memory and read all back. Raise SensorError."""
        for name, value in settings.items():
            self._ask(f"={name},{value}", name)
        self.settings = {name: self._ask(f"?{name}", name) for name in NAMES}
        for name, value in settings.items():
            if not same(self.settings[name], value):
                raise SensorError(
                    "kvh_setting_not_kept",
                    f"sensors.{self._sensor}: the KVH 1775 was set to {name},{value} and reads back "
                    f"{self.settings[name]}",
                    "Switch it off and on, then try again; if the problem persists, ask its maker",
                )

    def run(self) -> None:
        """Switch to normal mode, in which the instrument streams messages. Raise SensorError `kvh_silent`."""
        count_before = self._message_count
        period_s = 1.0 / float(self.settings["DR"])
        for wait_s in self._patience.attempts(MAX_ATTEMPTS * period_s):
            self._leave_configuration()
            if self.own_port.wait(lambda: self._message_count > count_before, wait_s):
                return
        raise SensorError(
            "kvh_silent",
            f"sensors.{self._sensor}: no message came from the KVH 1775 on {self.port} in normal mode",
            "Look at its MSYNC: an instrument that waits for an external one sends nothing by itself",
        )

    def test(self) -> BuiltInTest:
        """Return the result of the built-in test in normal mode. Raise SensorError `kvh_no_test`, `kvh_test_failed`."""
        self._tests.clear()
        period_s = 1.0 / float(self.settings["DR"])  # its result follows the next message
        for wait_s in self._patience.attempts(MAX_ATTEMPTS * period_s):
            self._write("?BIT")  # not ?BIT,2: in its result, bytes other than the 7f of the ICD mean "good" too
            if self.own_port.wait(lambda: bool(self._tests), wait_s):
                result = self._tests[0]
                if not result.passed:
                    raise SensorError(
                        "kvh_test_failed",
                        f"sensors.{self._sensor}: the built-in test of the KVH 1775 gives {result.values.hex(' ')}, "
                        "where 7f is good",
                        "Look the bits up in its manual, under the built-in test; do not calibrate it like this",
                    )
                return result
        raise SensorError(
            "kvh_no_test", f"{self._where} sends no result of its built-in test", "Switch it off and on, then try again"
        )

    def start(self, settings: Kvh1775Settings) -> None:
        """Pass messages, in the format and at the rate of `settings`, to `on_messages`, beginning with the next one."""
        with self.own_port.news:
            self._counter = MessageCounter(self._where, 1e6 / settings.rate_hz, timed=settings.message == "B")
            self._format = settings.message.encode()
            self.own_port.stream(2 / settings.rate_hz)

    @property
    def lost(self) -> int:
        """The number of lost messages."""
        return 0 if self._counter is None else self._counter.lost

    def listen(self, duration_s: float) -> None:
        """Receive the stream for `duration_s`. Raise errors that occur meanwhile."""
        self.own_port.wait(lambda: False, duration_s)

    def close(self) -> None:
        """Put the instrument into normal mode, its state after power-up, and close the port. May be called twice."""
        self.own_port.close()

    # -- the dialogue ----------------------------------------------------------------------------------------------
    def _enter_configuration(self) -> None:
        """Bring the instrument into configuration mode, from either mode."""
        try:
            self._ask("=CONFIG,1", "CONFIG")
        except SensorError as error:
            if error.name != "kvh_link_lost" or self.own_port.fault is not None:
                raise
            raise self._why_no_answer() from error

    def _why_no_answer(self) -> SensorError:
        """Return the error of an instrument that does not answer, judged by what it sends instead, if anything."""
        if self._message_count:
            does_not_hear = f"{self._where} sends, but does not answer"
            return SensorError("kvh_does_not_hear", does_not_hear, "Check the pair of wires to its receiver")
        if self._byte_count:
            received = f"{self._byte_count} bytes came from {self._where} at {self._baud} Bd"
            return SensorError(
                "kvh_wrong_baud_rate",
                f"{received}, but they hold no message or answer",
                "Set serial.baud to what the instrument is set to; it is delivered with 921600",
            )
        return SensorError("no_kvh", f"{self._where}: nothing came within {self._patience.first_s:g} s", _CABLE)

    def _ask(self, command: str, name: str) -> str:
        """Send `command`; return the answer after `name`. Raise SensorError `kvh_command_refused`, `kvh_link_lost`."""
        answer = re.compile(rb"%s,([^\r\n]*)[\r\n]" % re.escape(name.encode()))
        for wait_s in self._patience.attempts():
            with self.own_port.news:
                self._received.clear()
            self._write(command)
            self.own_port.wait(lambda: answer.search(self._received) is not None, wait_s)
            if (match := answer.search(self._received)) is not None:
                return match.group(1).decode("ascii", "replace").strip()
            # Checked last: INVALID may refer to half a command of another program, or to the leading empty line.
            if (invalid := re.search(rb"INVALID[^\r\n]*", self._received)) is not None:
                raise SensorError(
                    "kvh_command_refused",
                    f"sensors.{self._sensor}: the KVH 1775 answers {command} with "
                    f"{invalid.group().decode('ascii', 'replace')}",
                    "Look whether its software is older than its interface document 56-0298 Rev. B",
                )
        raise SensorError(
            "kvh_link_lost", f"{self._where} did not answer {command} within {self._patience.first_s:g} s", _CABLE
        )

    def _leave_configuration(self) -> None:
        self._write("=CONFIG,0")  # this command has no answer

    def _write(self, command: str) -> None:
        """Send a command, after a line end in case an incomplete command was sent before."""
        self.own_port.write(b"\r\n" + command.encode("ascii") + b"\r\n")

    # -- the reader's thread ---------------------------------------------------------------------------------------
    def _take(self, data: bytes, host_time_s: float) -> None:
        """Decode received bytes: keep answers and tests, and pass the messages on with numbers and times."""
        decoded = self._messages.feed(data)
        with self.own_port.news:
            silent_s = self.own_port.silence.lasts_s
            self.own_port.silence.note(len(decoded.messages))
            if not data:
                return
            self._byte_count += len(data)
            self._message_count += len(decoded.messages)
            self._received = (self._received + data)[-KEPT_BYTES:]
            self._tests += decoded.tests
            counter = self._counter
            self.own_port.news.notify_all()
        if counter is None:
            return
        if decoded.tests:
            raise SensorError(
                "kvh_restarted",
                f"{self._where} reported its built-in test while it streamed: it was switched off and on",
                "Check its supply, then run again",
            )
        if not len(decoded.messages):
            return
        if (decoded.messages["format"] != self._format).any():
            raise SensorError(
                "kvh_other_format",
                f"{self._where} sends another format than it was set to",
                "See that no other program talks to it, then run again",
            )
        numbers, times_us = counter.count(decoded.messages, silent_s)
        if self._on_messages is not None:
            self._on_messages(decoded.messages, numbers, times_us, host_time_s)
