"""`rig autopilot …`: write a calibration into an autopilot's parameters, or restore the old ones."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_run
from rig.errors import Refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.config.sensors.sensor_sections import SensorSection
    from rig.data.result_file import ResultDocument
    from rig.sensors.mavlink.autopilot_link import AutopilotLink
    from rig.sensors.mavlink.parameter_journal import ParameterChange

RISKS = {
    "gyroscope": "scale factors and axes of gyroscopes: no parameter holds them",
    "accelerometer": "axes and second order of accelerometers: no parameter holds them",
}


def add(autopilot: ArgumentParser) -> None:
    """Add the commands of `rig autopilot`."""
    commands = autopilot.add_subparsers(title="commands", required=True, metavar="COMMAND")
    text = "write the calibration of a passed run into the autopilot's parameters; a file keeps the old ones"
    store = commands.add_parser("store", help=text, description=text)
    add_config(store)
    add_run(store, "result", "a run folder or its result.json", metavar="RESULT")
    store.add_argument("--old", type=Path, metavar="FILE", help="file for the old values (default: by the result)")
    text = "restore the autopilot's parameters from a file that `store` wrote"
    restore = commands.add_parser("restore", help=text, description=text)
    add_config(restore)
    restore.add_argument("file", type=Path, metavar="FILE", help="file that `store` wrote")
    restore.add_argument("--new", action="store_true", help="restore the new values in it, not the old ones")
    for command, name in ((store, "store"), (restore, "restore")):
        command.add_argument("--yes", action="store_true", help="do not ask before the autopilot is changed")
        command.set_defaults(of_autopilot=name)


def run(options: Namespace) -> int:
    """Carry out the chosen command of `rig autopilot`; return 0."""
    return {"store": _store, "restore": _restore}[options.of_autopilot](options)


def _store(options: Namespace) -> int:
    """Write a passed run's calibration into the autopilot, and keep its old parameters in a file; return 0."""
    from rig.data.result_file import read_passed_result
    from rig.sensors.mavlink.parameter_encoding import AutopilotParameter, encode_value
    from rig.sensors.mavlink.parameter_journal import ParameterChange
    from rig.sensors.mavlink.writing import autopilot_id, find_unfinished_change
    from rig.station.confirm import require_agreement

    result = read_passed_result(options.result)
    with _connect(options) as (link, sections):
        for problem in find_unfinished_change(link):
            raise problem
        wanted = _read_values(link.identity.firmware, result, options.result, sections)
        old = link.parameters(wanted)
        if missing := wanted.keys() - old.keys():
            raise Refused(
                "autopilot_parameter_missing",
                f"the autopilot at {link.port} has no parameter {', '.join(sorted(missing))}",
                "Check that it has that IMU, and that its firmware is not older than ArduPilot 4.0 or PX4 1.12",
            )
        new = {
            name: AutopilotParameter(name, old[name].type, encode_value(value), link.identity.firmware)
            for name, value in wanted.items()
        }
        planned = ParameterChange(autopilot_id(link), link.identity.firmware, old, new, _backup_path(options))
        require_agreement([f"In the {link.identity.words}:", *_announce(planned, "new")], "store", options.yes)
        planned.keep()
        say(f"the old parameters are kept in {planned.backup}")
        _change(link, planned, "new")
        for line in RISKS.values():
            say(f"not stored: {line}")
    return 0


def _restore(options: Namespace) -> int:
    """Write the old (or with `--new` the new) parameters of a kept file into the same autopilot; return 0."""
    from rig.sensors.mavlink.parameter_journal import read_change
    from rig.sensors.mavlink.writing import autopilot_id
    from rig.station.confirm import require_agreement

    planned = read_change(options.file)
    with _connect(options) as (link, _):
        if (planned.autopilot_id, planned.firmware) != (autopilot_id(link), link.identity.firmware):
            raise Refused(
                "autopilot_other_uid",
                f"{options.file} is of the autopilot {planned.autopilot_id}, but the one at {link.port} is "
                f"{autopilot_id(link)}",
                "Connect that autopilot, or give the file of this one",
            )
        which = "new" if options.new else "old"
        require_agreement([f"In the {link.identity.words}:", *_announce(planned, which)], "restore", options.yes)
        _change(link, planned, which)
    return 0


def _change(link: "AutopilotLink", planned: "ParameterChange", which: str) -> None:
    from rig.errors import Fault, raise_as
    from rig.sensors.mavlink.writing import change

    to = planned.new if which == "new" else planned.old
    with raise_as(Fault):
        change(link, planned, to)
    say(f"written and read back, bit by bit: {len(to)} parameters, the {which} ones")


def _announce(planned: "ParameterChange", which: str) -> Iterator[str]:
    to, others = (planned.new, planned.old) if which == "new" else (planned.old, planned.new)
    for name, parameter in to.items():
        yield f"  {name}: {parameter.value:.9g}, instead of {others[name].value:.9g}"


def _read_values(
    firmware: int, result: "ResultDocument", path: Path, sections: Mapping[str, "SensorSection"]
) -> dict[str, float]:
    """Return the values of the parameters that store a run's calibrations of the sensors.

    Raise Refused `not_in_result`, and what `refuse_other_sensor` raises.
    """
    from math import degrees

    from rig.board.identify import refuse_other_sensor
    from rig.data.quantity import RATE
    from rig.report.exports.autopilots import ARDUPILOT as ARDUPILOTS
    from rig.report.exports.autopilots import IMU, PX4, sensor_parameters
    from rig.report.exports.exported_corrections import calibrations
    from rig.sensors.mavlink.autopilot_source import mavlink_section
    from rig.sensors.mavlink.dialect import ARDUPILOT

    autopilot = ARDUPILOTS if firmware == ARDUPILOT else PX4
    values: dict[str, float] = {}
    for calibration in calibrations(result).sensors:
        section = sections.get(calibration.sensor)
        if section is None or calibration.quantity not in IMU:
            continue
        part_and_number = calibration.part, calibration.serial_number
        range_deg_s = degrees(calibration.full_scale or 0.0) if calibration.quantity == RATE else section.range_deg_s
        refuse_other_sensor(f"{path}: the calibration of {calibration.sensor}", *part_and_number, range_deg_s, section)
        values |= dict(sensor_parameters(autopilot, mavlink_section(section).instance, calibration))
        if calibration.quantity == RATE and firmware == ARDUPILOT:
            values["INS_GYR_CAL"] = 0.0  # otherwise it estimates offsets of its own at each boot
    if not values:
        raise Refused(
            "not_in_result", f"{path} has no calibration for {', '.join(sections)}", "Give a run that calibrated them"
        )
    # Parameters of ArduPilot's temperature correction, which is off during a calibration.
    return {name: value for name, value in values.items() if not name.endswith("_CALTEMP")}


def _backup_path(options: Namespace) -> Path:
    if options.old is not None:
        return Path(options.old).resolve()
    result = Path(options.result)
    folder = result if result.is_dir() else result.parent
    return (folder / f"autopilot-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.json").resolve()


@contextmanager
def _connect(options: Namespace) -> Iterator[tuple["AutopilotLink", Mapping[str, "SensorSection"]]]:
    """Yield the link to the configuration's only autopilot, and its sensors. Raise Refused `no_autopilot_section`."""
    from rig.commands.laboratory.claims import claim_sensor
    from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
    from rig.commands.laboratory.own_address import load_at_own_address
    from rig.errors import raise_as
    from rig.sensors.mavlink.autopilot_link import AutopilotLink
    from rig.sensors.mavlink.autopilot_source import mavlink_section
    from rig.sensors.sensor_registry import group_by_port

    with ExitStack() as stack:
        loaded = stack.enter_context(load_at_own_address(options.config, options.overrides))
        sensors = {name: section for name, section in loaded.config.sensors.items() if section.mavlink is not None}
        autopilots = [(port, sections) for port, _, sections in group_by_port(sensors)]
        if len(autopilots) != 1:
            raise Refused(
                "no_autopilot_section",
                f"{options.config} has sensors of {len(autopilots)} autopilots",
                "Give a configuration with the sensors of one",
            )
        if loaded.simulated:
            stack.enter_context(run_simulated_laboratory(loaded.text))
            memory = "unless world.sensors.NAME.autopilot.parameter_file names a file that keeps it"
            say(
                f"simulated laboratory: its autopilot's memory lasts as long as this command, {memory}", file=sys.stderr
            )
        ((port, sections),) = autopilots
        name, section = next(iter(sections.items()))
        stack.enter_context(claim_sensor(name, port))
        stack.enter_context(raise_as(Refused))
        link = stack.enter_context(closing(AutopilotLink(name, port, mavlink_section(section).baud)))
        link.identify()
        yield link, sections
