"""Writes the text of a first configuration from a few answers: commented, and without a simulated laboratory. Pure."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from rig.config.sensors.lines_section import UNDETERMINED

Turner = Literal["hand", "arm", "servo"]
Source = Literal["board", "lines", "autopilot", "kvh1775"]

PROCEDURES: dict[Turner, str] = {"hand": "by_hand", "arm": "six_observation", "servo": "servo_six_observation"}
CONDITIONS: dict[Turner, int] = {"hand": 100, "arm": 10, "servo": 25}
# Arduino's usual sensor: a hand reaches 300 °/s, so its full scale must be at least 500 °/s.
MATRIX = "    correction: matrix     # the right angles of the axes are found too"
LINES_TEMPLATE = """\
sensors:
  imu:
    part: lines
    serial_number: {serial_number}
    rate_hz: 100           # how many lines the device prints in a second
    range_deg_s: {range_deg_s}       # full scale to which the device's program sets the gyroscope
    acceleration: {{range_g: {range_g}}}   # … and the accelerometer
    serial:
      port: {port}
      baud: 115200
    lines:                 # an example, for lines such as 1234567,0.12,-0.03,0.51,0.01,0.02,1.00
                           # correct it, or let `rig lines {port}` write it
      columns: [time, gx, gy, gz, ax, ay, az]
      separator: comma
      time: {{unit: "?", wrap: 4294967296}}   # us: micros() of an Arduino, which starts again there; 0: never
      rate: {{unit: "?"}}    # deg/s, rad/s, mdeg/s
      acceleration: {{unit: "?"}}   # g, m/s2, mg
"""


@dataclass(frozen=True, slots=True)
class Answers:
    """The turner, the measuring device, and their addresses.

    `sensors` is the section written by `rig lines`, if the device's lines were read. `part` is the sensor on the board.
    `arm_host`, `arm_model` and `payload_kg` belong to an arm, `servo_port` and `servo_model` to a servomotor.
    """

    turner: Turner
    source: Source
    port: str
    serial_number: str = UNDETERMINED
    range_deg_s: str = UNDETERMINED
    range_g: str = UNDETERMINED
    part: str = "lsm9ds1"
    sensors: str | None = None
    arm_host: str = "192.168.1.102"
    arm_model: str = "ur10e"
    payload_kg: float = 0.35
    servo_port: str = "/dev/ttyUSB0"
    servo_model: str = "xm430_w350"


def configuration_text(answers: Answers, schema: str, name: str) -> str:
    """Return the text of a file called `name`; `schema` is the location of the JSON schema for editors."""
    sections = (
        [
            f"# yaml-language-server: $schema={schema}",
            f"# A first configuration: rig check {name} checks that all is there; rig run {name} calibrates.",
            "# Every key, its unit and its range: the schema above, which an editor shows.",
        ],
        _turner(answers),
        _board(answers),
        _sensors(answers),
        _procedure(answers),
        _uncertainty(answers),
        _limits(answers),
        ["output:", "  folder: runs             # each run has a folder of its own in it"],
    )
    return "\n\n".join("\n".join(section) for section in map(list, sections) if section) + "\n"


def _turner(answers: Answers) -> Iterator[str]:
    if answers.turner == "hand":
        yield "turner: {kind: hand}       # you turn it, on a flat table, and are told how"
    elif answers.turner == "servo":
        yield "turner:"
        yield "  kind: servo"
        yield f"  port: {answers.servo_port}"
        yield "  id: 1                    # of the servo on its bus"
        yield f"  model: {answers.servo_model}"
        yield "  payload_kg: 0.12         # adapter, board, cable: weigh them"
        yield "  payload_centre_mm: [0, 0, 25]   # from the shaft's axis, z from its horn"
    else:
        yield "arm:"
        yield f"  host: {answers.arm_host}    # on the pendant: Settings, System, Network"
        yield f"  model: {answers.arm_model}"
        yield f"  payload_kg: {answers.payload_kg:g}         # board, holder, cable: weigh them"
        yield "  payload_centre_mm: [0, 0, 25]   # their centre of mass, from the middle of the flange"


def _board(answers: Answers) -> Iterator[str]:
    if answers.source == "board":
        yield "board:"
        yield f"  port: {answers.port}"


def _sensors(answers: Answers) -> Iterator[str]:
    if answers.sensors is not None:
        yield answers.sensors.rstrip("\n")
    elif answers.source == "lines":
        stated = {key: _text(getattr(answers, key)) for key in ("serial_number", "range_deg_s", "range_g")}
        example = LINES_TEMPLATE.format(port=answers.port, **stated).rstrip("\n")
        yield example if answers.turner != "hand" else example.replace("    serial:\n", f"{MATRIX}\n    serial:\n")
    else:
        yield from _part(answers)


def _part(answers: Answers) -> Iterator[str]:
    hand = answers.turner == "hand"
    part = {"board": answers.part, "autopilot": "mavlink", "kvh1775": "kvh1775"}[answers.source]
    yield "sensors:"
    yield "  gyro:                    # a name of your choice"
    yield f"    part: {part}"
    yield f"    serial_number: {_text(answers.serial_number)}   # of this one specimen"
    if part == "mavlink":
        yield "    rate_hz: 100"
        yield "    range_deg_s: 2000      # to which the firmware sets the IMU"
        yield f"    mavlink: {{port: {answers.port}, baud: 921600, imu: HIGHRES_IMU}}   # or SCALED_IMU, SCALED_IMU2, …"
    if part == "kvh1775":
        yield f"    serial: {{port: {answers.port}, baud: 921600, message: B}}"
    if hand:
        if part not in ("mavlink", "kvh1775"):
            yield "    range_deg_s: 500       # a hand reaches 300 °/s"
        yield MATRIX
        yield "    acceleration: {}       # shows which side is up, and is a level"
    elif answers.turner == "arm":
        yield "    mounting: {x: +x, y: +y, z: +z}   # the flange's axes along which the sensor's axes point"


def _procedure(answers: Answers) -> Iterator[str]:
    yield "procedure:"
    yield f"  name: {PROCEDURES[answers.turner]}"
    if answers.turner == "hand":
        yield "  flips: 12                # to another side of the box"
        yield "  turns: 3                 # once round on the table, against a straight edge"
        yield "  rest_s: 1"
        yield "  squareness_deg: 0.2      # for a box; 0.6 for a bare board"
    else:
        yield "  speed_deg_s: 60          # the sensor's range must be at least 1.5 times as large"
        yield "  rest_s: 3"


def _uncertainty(answers: Answers) -> Iterator[str]:
    if answers.turner == "hand" and answers.source != "board":
        yield "uncertainty:"
        yield "  crystal_ppm: 50          # how far the device's clock may be off: 50 for a crystal, 5000 for a"
        yield "                           # ceramic resonator such as that of an Arduino Uno. No reading shows it"
    elif answers.turner == "servo":
        yield "uncertainty:"
        yield "  mount_deg: 2             # how far off an adapter holds the board, about each axis"
        yield "  controller_clock_ppm: 50 # of this computer's clock, by which the shaft's times are taken"


def _limits(answers: Answers) -> Iterator[str]:
    yield "limits:                    # the verdict is PASS only within them"
    yield "  scale_deviation: 0.3     # |k − 1|: how far a scale factor may be from 1"
    yield "  scale_std: 0.002         # standard uncertainty of a scale factor"
    yield "  bias_rad_s: 0.1"
    yield "  bias_std_rad_s: 0.005"
    yield f"  condition: {CONDITIONS[answers.turner]}"


def _text(value: str) -> str:
    """Return a value as YAML text; a placeholder for a missing value is quoted."""
    return f'"{value}"' if value == UNDETERMINED else value
