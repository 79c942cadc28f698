"""`rig new FILE`: write a configuration from a few questions, with comments, and check it."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.devices.configuration_writing import refuse_existing, write_checked
from rig.commands.devices.lines import DURATIONS_S, add_stated, ask_stated, look_at_device, positive_number
from rig.commands.devices.terminal_questions import ask, ask_choice
from rig.errors import RigError
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.config.first_configuration import Answers, Source, Turner

TURNERS: "Mapping[Turner, str]" = {
    "hand": "your hand, on a flat table; nothing else is needed",
    "arm": "a robot arm of Universal Robots",
    "servo": "a Dynamixel servomotor",
}
SOURCES: "Mapping[Source, str]" = {
    "lines": "a microcontroller that prints an IMU's readings (Arduino, ESP32, any)",
    "board": "a sensor on the rig's board, a Nucleo-L432KC",
    "autopilot": "the IMU of an autopilot (ArduPilot, PX4)",
    "kvh1775": "a KVH 1775 on its own port",
}
ANOTHER_PART = "another"


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig new`: the file, and an option for each question."""
    parser.add_argument("file", type=Path, metavar="FILE", help="new configuration file, such as my.yaml")
    parser.add_argument("--turner", choices=TURNERS, help="what turns the sensors")
    parser.add_argument("--sensor", choices=SOURCES, help="what measures")
    parser.add_argument("--port", metavar="PORT", help="port of the sensor: /dev/ttyACM0, COM3, socket://host:port")
    parser.add_argument("--part", metavar="PART", help="the sensor on the board")
    add_stated(parser)
    parser.add_argument("--host", metavar="ADDRESS", help="address of the arm's controller")
    parser.add_argument("--model", metavar="MODEL", help="model of the arm or the servomotor")
    parser.add_argument("--payload-kg", metavar="KG", help="mass of all that the arm's flange carries")
    parser.add_argument("--servo-port", metavar="PORT", help="serial port of the servomotor's adapter")
    parser.add_argument(
        "--listen",
        choices=("yes", "no"),
        help="whether to look at a device that prints lines for ten seconds; if not, its section is an example",
    )


def run(options: Namespace) -> int:
    """Ask for values that no option states, write the file and check it; return 0, or 1 if values remain open.

    Raise Refused `not_answered`, `bad_option`, `configuration_not_written`.
    """
    refuse_existing(options.file)
    return write_checked(options.file, _read_answers(options))


def _read_answers(options: Namespace) -> "Answers":
    """Return the answers from options, or else from questions at the terminal."""
    from rig.config.first_configuration import Answers
    from rig.config.sensors.sensor_catalogue import PARTS
    from rig.config.sensors.sensor_sections import check_serial_number

    turner = ask_choice("What turns the sensors?", "--turner", TURNERS, options.turner)
    sources = {key: words for key, words in SOURCES.items() if key != "kvh1775" or turner == "arm"}
    source = ask_choice("What measures?", "--sensor", sources, options.sensor)
    more = _turner_answers(turner, options)
    port = _port("Where does it answer?", "--port", options.port)
    if source == "lines":
        return Answers(turner, source, port, **_lines_answers(options, port, by_hand=turner == "hand"), **more)
    parts = {name: name for name, part in PARTS.items() if not part.own_port and name != "mavlink"}
    if source == "board":
        more["part"] = ask_choice("Which sensor is it?", "--part", parts, options.part)
    serial_number = ask(
        "serial number of this specimen", "--serial-number", check_serial_number, value=options.serial_number
    )
    return Answers(turner, source, port, serial_number, **more)


def _turner_answers(turner: "Turner", options: Namespace) -> dict[str, Any]:
    """Return the turner's address and model from options or questions; empty for a hand."""
    from rig.config.models import ArmSection
    from rig.config.procedures.servo_section import ServoSection
    from rig.config.section import check_host

    if turner == "arm":
        usual = ArmSection.model_fields["model"]
        return {
            "arm_host": ask(
                "address of the arm (pendant: Settings, System, Network)", "--host", check_host, value=options.host
            ),
            "arm_model": ask_choice(
                "Which arm is it?", "--model", _literals(usual.annotation), options.model, usual.default
            ),
            "payload_kg": float(
                ask(
                    "mass on the flange (board, holder, cable), kg",
                    "--payload-kg",
                    positive_number,
                    "0.35",
                    options.payload_kg,
                )
            ),
        }
    if turner == "servo":
        models = _literals(ServoSection.model_fields["model"].annotation)
        return {
            "servo_port": _port("Where is the servomotor's adapter?", "--servo-port", options.servo_port),
            "servo_model": ask_choice("Which servomotor is it?", "--model", models, options.model),
        }
    return {}


def _lines_answers(options: Namespace, port: str, *, by_hand: bool) -> dict[str, Any]:
    """Return the sensor's section, guessed from the device's lines if the user wants that and it succeeds.

    Otherwise return only the values that the user states.
    """
    choices = {"yes": "yes: ten seconds, and nothing is left to look up", "no": "no: write an example, to be edited"}
    user_values = ask_stated(options, by_hand=by_hand)
    if ask_choice("Look at the device now?", "--listen", choices, options.listen) == "yes":
        try:
            return {"sensors": look_at_device(port, None, "imu", DURATIONS_S, user_values)}
        except RigError as error:
            say(f"{error}\nThe file contains an example in its place; `rig lines {port}` writes it later.", sys.stderr)
    stated_here = {key: getattr(user_values, key) for key in ("serial_number", "range_deg_s", "range_g")}
    return {key: value for key, value in stated_here.items() if value is not None}


def _literals(annotation: object) -> Mapping[str, str]:
    from typing import get_args

    return {str(value): str(value) for value in get_args(annotation)}


def _port(question: str, option: str, chosen_port: str | None) -> str:
    """Return a serial port that the user chooses from this computer's ports, or types."""
    from firmware_host.serial_port import describe_ports, find_ports
    from rig.config.section import check_port

    def valid(value: str) -> str:
        try:
            return check_port(value)
        except ValueError as error:
            raise ValueError("; ".join(filter(None, [str(error), describe_ports()]))) from None

    if chosen_port is None and (ports := find_ports()):
        choice = ask_choice(question, option, {**ports, ANOTHER_PART: "another, or one that is not plugged in yet"})
        if choice != ANOTHER_PART:
            return choice
    return ask("port, such as /dev/ttyUSB0, COM3 or socket://host:port", option, valid, value=chosen_port)
