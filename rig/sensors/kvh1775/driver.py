"""The host end of a KVH 1775's line: a thread that reads, a dialogue in configuration mode, a stream in normal mode.

The same driver talks to the instrument over RS-422 and to the simulated one: bytes on a port.
"""

import re
from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.counting import MessageCounter
from rig.sensors.kvh1775.messages import BuiltInTest, MessageReader
from rig.sensors.kvh1775.settings import NAMES, Wanted, same
from rig.sensors.own_port import Faults, OwnPort, closed_on_failure, opened
from rig.sensors.silence import ATTEMPTS, USUAL, Patience

KEPT_BYTES = 4096  # of what came while an answer was awaited
_CABLE = "Check its supply and cable, and whether another program has the port"

# Messages (n,) MESSAGE_DTYPE, their numbers (n,) from 0, their times (n,) in µs, and when they were read.
OnMessages = Callable[[NDArray[Any], NDArray[Any], NDArray[Any], float], None]


class Kvh1775:
    """The instrument on a serial port or `socket://host:port`, until `close`. `on_messages` runs on its thread.

    What goes wrong is a SensorError whose name begins with `kvh_`; all messages name `sensor`, as the configuration.
    """

    def __init__(
        self,
        sensor: str,
        port: str,
        baud: int,
        on_messages: OnMessages | None = None,
        *,
        patience: Patience = USUAL,
    ) -> None:
        """Opens the port, ends a stream that may be running, and asks for number and settings.

        Raises SensorError: no_port, no_kvh, kvh_wrong_baud_rate, kvh_does_not_hear, kvh_command_refused.
        """
        self._sensor, self.port, self._baud = sensor, port, baud
        self._where = f"sensors.{sensor}: the KVH 1775 on {port}"
        self._on_messages, self._patience = on_messages, patience
        self._messages = MessageReader()
        self._bytes_seen = self._messages_seen = 0
        self._tests: list[BuiltInTest] = []
        self._counter: MessageCounter | None = None  # while it streams
        self._format = b""
        self._heard = bytearray()
        no_message = f"sensors.{sensor}: no whole message from the KVH 1775 on {port}"
        faults = Faults(
            closed=SensorError("kvh_link_lost", f"sensors.{sensor}: the port {port} closed", _CABLE),
            silent=SensorError("kvh_link_lost", no_message, _CABLE),
            not_taken=SensorError("kvh_not_taken", f"sensors.{sensor}", "See the run's log"),
        )
        serial = opened(port, baud, where=f"sensors.{sensor}: ", named_by="serial.port")
        self.own_port = OwnPort(serial, port, faults, self._take, patience=patience, farewell=self._to_normal_mode)
        self.own_port.begin()
        with closed_on_failure(self.close):
            self._configure()
            self.serial_number = self._ask("?IS", "IS")
            self.settings = {name: self._ask(f"?{name}", name) for name in NAMES}

    def correct(self, settings: dict[str, str]) -> None:
        """Changes settings in its memory, and reads every one back. Raises SensorError, also `kvh_setting_not_kept`."""
        for name, value in settings.items():
            self._ask(f"={name},{value}", name)
        self.settings = {name: self._ask(f"?{name}", name) for name in NAMES}
        for name, value in settings.items():
            if not same(self.settings[name], value):
                raise SensorError(
                    "kvh_setting_not_kept",
                    f"sensors.{self._sensor}: the KVH 1775 was set to {name},{value} and reads back "
                    f"{self.settings[name]}",
                    "Switch it off and on, then try again; if it stays, ask its maker",
                )

    def run(self) -> None:
        """Back to normal mode, in which it sends messages as it is set to. Raises SensorError `kvh_silent`."""
        seen = self._messages_seen
        period_s = 1.0 / float(self.settings["DR"])
        for wait_s in self._patience.attempts(ATTEMPTS * period_s):
            self._to_normal_mode()
            if self.own_port.wait(lambda: self._messages_seen > seen, wait_s):
                return
        raise SensorError(
            "kvh_silent",
            f"sensors.{self._sensor}: no message came from the KVH 1775 on {self.port} in normal mode",
            "Look at its MSYNC: an instrument that waits for an external one sends nothing by itself",
        )

    def test(self) -> BuiltInTest:
        """What its built-in test says, in normal mode. Raises SensorError `kvh_no_test`, `kvh_test_failed`."""
        self._tests.clear()
        period_s = 1.0 / float(self.settings["DR"])  # its result follows the next message
        for wait_s in self._patience.attempts(ATTEMPTS * period_s):
            self._write("?BIT")  # ?BIT,2 has bytes that the ICD does not print as 7f when all is well
            if self.own_port.wait(lambda: bool(self._tests), wait_s):
                found = self._tests[0]
                if not found.passed:
                    raise SensorError(
                        "kvh_test_failed",
                        f"sensors.{self._sensor}: the built-in test of the KVH 1775 gives {found.values.hex(' ')}, "
                        "where 7f is good",
                        "Look the bits up in its manual, under the built-in test; do not calibrate it like this",
                    )
                return found
        raise SensorError(
            "kvh_no_test",
            f"{self._where} sends no result of its built-in test",
            "Switch it off and on, then try again",
        )

    def start(self, wanted: Wanted) -> None:
        """Start to hand everything to `on_messages`, from the next message on."""
        with self.own_port.news:
            self._counter = MessageCounter(self._where, 1e6 / wanted.rate_hz, timed=wanted.message == "B")
            self._format = wanted.message.encode()
            self.own_port.stream(2 / wanted.rate_hz)

    @property
    def lost(self) -> int:
        """Messages lost in the stream."""
        return 0 if self._counter is None else self._counter.lost

    def listen(self, duration_s: float) -> None:
        """Waits so long while it streams. Raises what goes wrong meanwhile."""
        self.own_port.wait(lambda: False, duration_s)

    def close(self) -> None:
        """Leaves it in normal mode, as after switching on, and closes the port. May be called twice."""
        self.own_port.close()

    # -- the dialogue ----------------------------------------------------------------------------------------------
    def _configure(self) -> None:
        """Bring the instrument into configuration mode, from whichever it is in."""
        try:
            self._ask("=CONFIG,1", "CONFIG")
        except SensorError as error:
            if error.name != "kvh_link_lost" or self.own_port.fault is not None:
                raise
            raise self._why_no_answer() from error

    def _why_no_answer(self) -> SensorError:
        if self._messages_seen:
            does_not_hear = f"{self._where} sends, but does not answer"
            return SensorError("kvh_does_not_hear", does_not_hear, "Check the pair of wires to its receiver")
        if self._bytes_seen:
            came = f"{self._bytes_seen} bytes came from {self._where} at {self._baud} Bd"
            return SensorError(
                "kvh_wrong_baud_rate",
                f"{came}, and no message or answer in them",
                "Set serial.baud to what the instrument is set to; it is delivered with 921600",
            )
        return SensorError("no_kvh", f"{self._where}: nothing came within {self._patience.first_s:g} s", _CABLE)

    def _ask(self, command: str, name: str) -> str:
        """What stands behind `name` in the answer. Raises SensorError `kvh_command_refused`, `kvh_link_lost`."""
        answer = re.compile(rb"%s,([^\r\n]*)[\r\n]" % re.escape(name.encode()))
        for wait_s in self._patience.attempts():
            with self.own_port.news:
                self._heard.clear()
            self._write(command)
            self.own_port.wait(lambda: answer.search(self._heard) is not None, wait_s)
            if (found := answer.search(self._heard)) is not None:
                return found.group(1).decode("ascii", "replace").strip()
            # Only now: what it finds invalid may have been half a command of somebody else's, or the empty line before.
            if (invalid := re.search(rb"INVALID[^\r\n]*", self._heard)) is not None:
                raise SensorError(
                    "kvh_command_refused",
                    f"sensors.{self._sensor}: the KVH 1775 answers {command} with "
                    f"{invalid.group().decode('ascii', 'replace')}",
                    "Look whether its software is older than its interface document 56-0298 Rev. B",
                )
        raise SensorError(
            "kvh_link_lost",
            f"{self._where} did not answer {command} within {self._patience.first_s:g} s",
            _CABLE,
        )

    def _to_normal_mode(self) -> None:
        self._write("=CONFIG,0")  # which is not answered

    def _write(self, command: str) -> None:
        """The leading line end finishes whatever half a command it may have heard before."""
        self.own_port.write(b"\r\n" + command.encode("ascii") + b"\r\n")

    # -- the reader's thread ---------------------------------------------------------------------------------------
    def _take(self, data: bytes, host_time_s: float) -> None:
        decoded = self._messages.feed(data)
        with self.own_port.news:
            silent_s = self.own_port.silence.lasts_s
            self.own_port.silence.note(len(decoded.messages))
            if not data:
                return
            self._bytes_seen += len(data)
            self._messages_seen += len(decoded.messages)
            self._heard = (self._heard + data)[-KEPT_BYTES:]
            self._tests += decoded.tests
            counter = self._counter
            self.own_port.news.notify_all()
        if counter is None or not len(decoded.messages):
            return
        if decoded.tests:
            raise SensorError(
                "kvh_restarted",
                f"{self._where} told of its built-in test while it streamed: it was switched off and on",
                "Check its supply, then run again",
            )
        if (decoded.messages["format"] != self._format).any():
            raise SensorError(
                "kvh_other_format",
                f"{self._where} sends another format than it was set to",
                "See that no other program talks to it, then run again",
            )
        numbers, times_us = counter.count(decoded.messages, silent_s)
        if self._on_messages is not None:
            self._on_messages(decoded.messages, numbers, times_us, host_time_s)
