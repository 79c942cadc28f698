"""The host end of an autopilot's link: a thread that reads, a dialogue about parameters, a stream of IMU messages.

The same link talks to an autopilot over a cable and to the simulated one, as bytes on a port.
"""

import threading
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_port import open_port
from rig.sensors.mavlink.dialect import ARMED_FLAG, FIRMWARES, dialect
from rig.sensors.mavlink.message_losses import LinkCounter
from rig.sensors.mavlink.parameter_encoding import AutopilotParameter, decode_float, extract_value
from rig.sensors.own_port import OwnPort, PortFaults, closing_on_failure, open_device_port
from rig.sensors.port_silence import PATIENCE, Patience

HEARTBEAT_S = 1.0
OWN_ADDRESS = (255, 190)  # system and component of a ground station (mavlink.io, MAV_COMP_ID_MISSIONPLANNER)
GROUND_STATION, NO_AUTOPILOT = 6, 8  # MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID
SET_INTERVAL, REQUEST_MESSAGE = 511, 512  # MAV_CMD
AUTOPILOT_VERSION = 148
ACCEPTED = 0  # MAV_RESULT
_CABLE = "Check its supply and cable, and whether another program, such as a ground station, has the port"

# Messages of pymavlink in order, each with whether no message before it was lost, and the time of the read.
OnMessages = Callable[[list[tuple[Any, bool]], float], None]


@dataclass(frozen=True, slots=True)
class Autopilot:
    """An autopilot's identity.

    `system` and `component` are its address in a MAVLink network, `firmware` is the number of its firmware
    (MAV_AUTOPILOT), `uid` is its unique number.
    """

    system: int
    component: int
    firmware: int
    version: str = "unknown"
    uid: str = ""

    @property
    def words(self) -> str:
        """Firmware, version and number in a line of text."""
        return f"{FIRMWARES[self.firmware]} {self.version}, number {self.uid or 'unknown'}"


class AutopilotLink:
    """The link to an autopilot at a port, which stays open until `close`.

    A thread reads the port and calls `on_messages` with the messages in `wanted`. Errors are SensorErrors; their
    messages name the configured `sensor`.
    """

    def __init__(
        self, sensor: str, port: str, baud: int, on_messages: OnMessages | None = None, *, patience: Patience = PATIENCE
    ) -> None:
        """Open the port, and wait for the heartbeat of an autopilot, which must not be armed.

        Raise SensorError `no_port`, `no_autopilot`, `mavlink_no_message`, `mavlink_other_device`, `autopilot_armed`;
        Refused `missing_extra`.
        """
        self._mavlink = dialect()
        self._sensor, self.port, self._baud, self._patience = sensor, port, baud, patience
        self._on_messages = on_messages
        self.wanted: Collection[str] = ()
        self._parser = self._mavlink.MAVLink(None, srcSystem=OWN_ADDRESS[0], srcComponent=OWN_ADDRESS[1])
        self._parser.robust_parsing = True
        self.counter = LinkCounter()
        self.autopilot: Autopilot | None = None
        self.armed = False
        self._byte_count = self._other_count = 0
        self._parameters: dict[str, AutopilotParameter] = {}
        self._used: dict[str, AutopilotParameter] = {}  # by which the stream's readings are interpreted
        self._answers: dict[int, int] = {}
        self._version: Any = None
        self._sending = threading.Lock()
        self._beaten_s = 0.0
        faults = PortFaults(
            closed=SensorError("mavlink_link_lost", f"{self._where}: the port closed", _CABLE),
            silent=SensorError("mavlink_link_lost", f"{self._where} has sent no reading", _CABLE),
            not_taken=SensorError("mavlink_not_taken", f"sensors.{sensor}", "See the run's log"),
        )
        line = open_device_port(port, baud, open_port, owner=f"sensors.{sensor}: ", setting="mavlink.port")
        self.own_port = OwnPort(line, port, faults, self._take, patience=patience, farewell=self._restore_intervals)
        self.own_port.begin()
        with closing_on_failure(self.close):
            self._find()

    @property
    def identity(self) -> Autopilot:
        """The identity of the autopilot that answers."""
        assert self.autopilot is not None, "there is none without a heartbeat"
        return self.autopilot

    # -- the dialogue ----------------------------------------------------------------------------------------------
    def parameters(self, needed: Iterable[str], others: Iterable[str] = ()) -> Mapping[str, AutopilotParameter]:
        """Return the parameters, `needed` and `others`, that the autopilot sends on request.

        A request is repeated until it is answered: for `needed` parameters until the time-out, for others a few times.
        Raise SensorError `autopilot_silent` if no parameter comes.
        """
        needed = set(needed)
        names = needed | set(others)
        with self.own_port.news:
            for name in names:
                self._parameters.pop(name, None)
        for wait_s in self._patience.attempts():
            for name in sorted(names - self._parameters.keys()):
                self._send(self._mavlink.MAVLink_param_request_read_message(*self._address, name.encode(), -1))
            self.own_port.wait(lambda: names <= self._parameters.keys(), wait_s)
            if needed <= self._parameters.keys() and wait_s > 2 * self._patience.attempts()[0]:
                break
        parameters = {name: self._parameters[name] for name in names & self._parameters.keys()}
        if not parameters:
            raise SensorError(
                "autopilot_silent",
                f"{self._where} sends, but answers no request for a parameter",
                "Check the line to its receiver (RX), and that the port is not one that only sends",
            )
        return parameters

    def stream(self) -> None:
        """Begin to expect readings. From now on a change of a parameter that was requested is an error."""
        with self.own_port.news:
            self._used = dict(self._parameters)
            self.own_port.stream()

    def set_parameter(self, parameter: AutopilotParameter) -> AutopilotParameter:
        """Set a parameter to its four bytes and return the answer. Raise SensorError `autopilot_not_set`."""
        with self.own_port.news:
            self._parameters.pop(parameter.name, None)
        value = decode_float(parameter.field)
        for wait_s in self._patience.attempts():
            name = parameter.name.encode()
            self._send(self._mavlink.MAVLink_param_set_message(*self._address, name, value, parameter.type))
            if self.own_port.wait(lambda: parameter.name in self._parameters, wait_s):
                return self._parameters[parameter.name]
        raise SensorError(
            "autopilot_not_set",
            f"{self._where} does not answer that {parameter.name} was set",
            "Check the cable. What was written so far is in the journal; the same command continues from there",
        )

    def ask_for(self, message: str, interval_us: float) -> None:
        """Request a message at an interval in µs. Raise SensorError `autopilot_message_refused`."""
        number = getattr(self._mavlink, f"MAVLINK_MSG_ID_{message}")
        answer = self._command(SET_INTERVAL, number, interval_us)
        if answer != ACCEPTED:
            reply = "nothing" if answer is None else f"result {answer}"
            raise SensorError(
                "autopilot_message_refused",
                f"{self._where} answers {reply} to the request for {message}",
                "Choose another message with mavlink.imu: not every firmware has all of them",
            )

    def request(self, message: str) -> None:
        """Request a message once. An autopilot that does not know this request ignores it."""
        number = getattr(self._mavlink, f"MAVLINK_MSG_ID_{message}")
        self._send(self._command_message(REQUEST_MESSAGE, number, 0.0))

    def identify(self) -> None:
        """Request the autopilot's version and unique number; some autopilots do not report these."""
        for wait_s in self._patience.attempts()[:2]:
            self._send(self._command_message(REQUEST_MESSAGE, AUTOPILOT_VERSION, 0.0))
            if self.own_port.wait(lambda: self._version is not None, wait_s):
                break
        if self._version is not None:
            version = self._version.flight_sw_version
            uid = bytes(self._version.uid2).strip(b"\0").hex() or f"{self._version.uid:016x}".strip("0")
            version_text = f"{version >> 24}.{version >> 16 & 255}.{version >> 8 & 255}"
            identity = self.identity
            self.autopilot = Autopilot(identity.system, identity.component, identity.firmware, version_text, uid)

    def close(self) -> None:
        """Restore the former message intervals, and close the port. May be called twice."""
        self.own_port.close()

    # -- inside ----------------------------------------------------------------------------------------------------
    @property
    def _where(self) -> str:
        return f"sensors.{self._sensor}: the autopilot at {self.port}"

    @property
    def _address(self) -> tuple[int, int]:
        return self.identity.system, self.identity.component

    def _find(self) -> None:
        """Wait for an autopilot's message; raise SensorError if none comes, or if the autopilot is armed."""
        if not self.own_port.wait(lambda: self.autopilot is not None, self._patience.first_s):
            if self._other_count:
                raise SensorError(
                    "mavlink_other_device",
                    f"{self._where}: the device that sends MAVLink there is neither ArduPilot nor PX4",
                    "Connect the autopilot itself, not a radio or a camera",
                )
            if self._byte_count:
                raise SensorError(
                    "mavlink_no_message",
                    f"{self._byte_count} bytes came from {self._where} at {self._baud} Bd, but they hold no message",
                    "Set mavlink.baud to the speed of that port of the autopilot (SERIALn_BAUD, SER_TELn_BAUD), and "
                    "see that the port speaks MAVLink 2",
                )
            raise SensorError(
                "no_autopilot", f"{self._where}: nothing came within {self._patience.first_s:g} s", _CABLE
            )
        if self.armed:
            raise self._describe_armed()

    def _describe_armed(self) -> SensorError:
        return SensorError(
            "autopilot_armed",
            f"{self._where} is armed: its motors may turn",
            "Disarm it, and take the propellers off before anything else",
        )

    def _command(self, command: int, first: float, second: float) -> int | None:
        with self.own_port.news:
            self._answers.pop(command, None)
        for wait_s in self._patience.attempts():
            self._send(self._command_message(command, first, second))
            if self.own_port.wait(lambda: command in self._answers, wait_s):
                return self._answers[command]
        return None

    def _command_message(self, command: int, first: float, second: float) -> Any:
        return self._mavlink.MAVLink_command_long_message(*self._address, command, 0, first, second, 0, 0, 0, 0, 0)

    def _send(self, message: Any) -> None:
        with self._sending:
            self.own_port.write(message.pack(self._parser))
            self._parser.seq = (self._parser.seq + 1) % 256

    def _restore_intervals(self) -> None:
        for message in self.wanted if self.autopilot is not None else ():
            number = getattr(self._mavlink, f"MAVLINK_MSG_ID_{message}")
            self._send(self._command_message(SET_INTERVAL, number, 0.0))

    # -- the reader's thread ---------------------------------------------------------------------------------------
    def _beat(self) -> None:
        """Send the heartbeat of a ground station every second."""
        if time.monotonic() - self._beaten_s > HEARTBEAT_S:
            self._beaten_s = time.monotonic()
            self._send(self._mavlink.MAVLink_heartbeat_message(GROUND_STATION, NO_AUTOPILOT, 0, 0, 4, 3))

    def _take(self, data: bytes, host_time_s: float) -> None:
        """Parse received bytes, note the autopilot's state, and pass the wanted messages on."""
        self._beat()
        wanted_messages: list[tuple[Any, bool]] = []
        with self.own_port.news:
            self._byte_count += len(data)
            has_message = False
            for message in (self._parser.parse_buffer(data) or []) if data else []:
                if message.get_type() == "BAD_DATA" or not self._is_from_autopilot(message):
                    continue
                has_message, lost = True, self.counter.lost
                if not self.counter.is_new(message.get_seq(), bytes(message.get_msgbuf())):
                    continue
                self._note(message)
                if message.get_type() in self.wanted:
                    wanted_messages.append((message, self.counter.lost == lost))
            # A restarted autopilot sends heartbeats, but no longer the requested messages.
            self.own_port.silence.note(len(wanted_messages) if self.own_port.streams else has_message)
            if self.armed and self.own_port.streams:
                raise self._describe_armed()
            if data:
                self.own_port.news.notify_all()
        if wanted_messages and self._on_messages is not None:
            self._on_messages(wanted_messages, host_time_s)
            with self.own_port.news:
                self.own_port.news.notify_all()

    def _refuse_change(self, parameter: AutopilotParameter) -> None:
        """Raise SensorError `autopilot_parameter_changed` if readings were interpreted by another value."""
        used = self._used.get(parameter.name, parameter)
        if used.field != parameter.field:
            raise SensorError(
                "autopilot_parameter_changed",
                f"{self._where}: while it streamed, its parameter {parameter.name} changed from {used.value:g} to "
                f"{parameter.value:g}",
                "Close every ground station and program that talks to the autopilot, then run again",
            )

    def _is_from_autopilot(self, message: Any) -> bool:
        """Return whether a message came from the selected autopilot, which is the first one with a heartbeat."""
        source = (message.get_srcSystem(), message.get_srcComponent())
        if self.autopilot is None and message.get_type() == "HEARTBEAT":
            if message.autopilot in FIRMWARES:
                self.autopilot = Autopilot(*source, message.autopilot)
            else:
                self._other_count += 1
        return self.autopilot is not None and source == self._address

    def _note(self, message: Any) -> None:
        """Store a message's contents by its type: state, parameter, answer or version."""
        match message.get_type():
            case "HEARTBEAT":
                self.armed = bool(message.base_mode & ARMED_FLAG)
            case "PARAM_VALUE":
                name = message.param_id
                field = extract_value(bytes(message.get_msgbuf()))
                self._parameters[name] = AutopilotParameter(name, message.param_type, field, self.identity.firmware)
                self._refuse_change(self._parameters[name])
            case "COMMAND_ACK":
                self._answers[message.command] = message.result
            case "AUTOPILOT_VERSION":
                self._version = message
