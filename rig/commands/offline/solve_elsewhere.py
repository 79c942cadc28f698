"""`rig solve SAMPLES.csv --sweeps|--attitudes FILE` or `--turns`: readings made elsewhere go the way of a run."""

import sys
from argparse import ArgumentParser, Namespace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.history.named_history import add_history, named_history
from rig.errors import Refused, raised_as
from rig.errors.quoting import shorten
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.outcome import Outcome
    from rig.commands.history.remember import Beside
    from rig.config.column_map import ColumnMap
    from rig.data.recording.motion_file import Columns
    from rig.data.recording.run_file import RunData

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")


def add(solve: ArgumentParser) -> None:
    """The arguments of readings that were made elsewhere."""
    group = solve.add_argument_group("with --sweeps, --attitudes or --turns")
    group.add_argument(
        "--columns",
        type=Path,
        metavar="YAML",
        help="what stands where in the files, where their columns have names and units of their own",
    )
    group.add_argument("--out", type=Path, metavar="DIR", help="a new run folder for result, certificate, pictures")
    group.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="SENSOR",
        help="calibrate this sensor alone of those whose readings the file holds: gyroscope, accelerometer, "
        "magnetometer; may be given more than once",
    )
    add_history(group)
    group.add_argument("--name", default="imu", metavar="NAME", help="what the sensor is called (default: imu)")
    group.add_argument("--part", metavar="PART", help="which part it is")
    group.add_argument("--serial-number", metavar="NUMBER", help="which specimen it is; a history needs it")
    group.add_argument(
        "--recorded",
        type=datetime.fromisoformat,
        metavar="TIME",
        help="when the readings were made (2026-11-25T08:30, UTC); left out, when their file was last written",
    )
    swept = solve.add_argument_group("with --sweeps")
    swept.add_argument(
        "--reference-c",
        type=float,
        metavar="CELSIUS",
        help="scale and bias over temperature: the sweeps are repeated at several, which the column temperature_c "
        "tells; what is not a function of temperature is stated at this one",
    )
    hand = solve.add_argument_group("with --turns")
    hand.add_argument(
        "--clock-ppm",
        type=float,
        metavar="PPM",
        help="how far the time stamps may be off (20 to 50 of a crystal); needed, for no reading shows it",
    )
    hand.add_argument(
        "--squareness-deg",
        type=float,
        default=0.2,
        metavar="DEG",
        help="how far the faces are out of square (default: 0.2)",
    )
    hand.add_argument("--no-closure", action="store_true", help="turns on a face were not against a straight edge")
    hand.add_argument(
        "--first-face", choices=AXES, help="which axis pointed upwards at first; needed without an accelerometer"
    )
    place = solve.add_argument_group("with --attitudes")
    place.add_argument(
        "--gravity-m-s2",
        type=float,
        default=STANDARD_GRAVITY_M_S2,
        metavar="G",
        help="size of gravity at the place (default: the standard 9.80665); scale factors are relative to it",
    )
    place.add_argument(
        "--up", default="+z", choices=AXES, help="axis of the table that points upwards, roughly (default: +z)"
    )
    place.add_argument("--field-t", type=float, metavar="B", help="size of the magnetic field, for a magnetometer")
    place.add_argument("--field-upwards", action="store_true", help="the magnetic field rises from the ground")
    place.add_argument("--any-mounting", action="store_true", help="the sensor's axes need not lie along the body's")
    place.add_argument(
        "--estimate-clock-offset",
        action="store_true",
        help="the attitudes are on a clock of their own: find it by the turning that both files show",
    )
    place.add_argument(
        "--exact-rates",
        action="store_true",
        help="the attitudes' rates are exact, as a rate table's are: solve the gyroscope by them, not by increments",
    )
    place.add_argument(
        "--window-s",
        type=float,
        metavar="SECONDS",
        help="over which attitudes are averaged for a gyroscope's increments (default: 1, less for short recordings)",
    )
    place.add_argument("--second-order", action="store_true", help="find the accelerometer's second-order terms too")


def run(options: Namespace) -> int:
    """Solve the two files and print the result; with `--out` a run folder too, entered in the history.

    Returns 0, or 1 where a check of the solves failed. Raises Refused `bad_option`, `run_folder`, as
    `build_recording`, and whatever the solve finds wrong.
    """
    from rig.analysis.analyses import calibrate
    from rig.commands.history.remember import since_lines
    from rig.commands.standard_streams import tell_where_the_result_is
    from rig.data.run_folder import RESULT
    from rig.report.document import document_of
    from rig.report.terminal.table import print_kept, print_outcome

    if options.history is not None and options.out is None:
        raise Refused("bad_option", "--history is for runs that are kept", "Give --out, which keeps the run")
    with raised_as(Refused):  # nothing runs here: whatever is wrong with the data, no arm had to be stopped for it
        recording = _recording(options)
        outcome = calibrate([recording])
    beside = () if options.out is None else _kept(options, recording, outcome)
    result = document_of(outcome)
    if options.out is None or options.all:
        print_outcome(result, as_json=options.json, whole=options.all)
    else:
        print_kept(options.out, result, since_lines(beside), as_json=options.json)
    if options.out is not None:
        tell_where_the_result_is(options.out / RESULT)
    return 0 if outcome.passed else 1


def _recording(options: Namespace) -> "RunData":
    import numpy as np

    from rig.data.checked import validate
    from rig.data.recording.motion_file import Item
    from rig.data.recording.settings import Elsewhere, Site
    from rig.observation.external.from_files import Files, build_recording

    for name in ("gravity_m_s2", "field_t", "window_s"):
        value: float | None = getattr(options, name)
        if value is not None and not 0 < value < float("inf"):
            option = f"--{name.replace('_', '-')}"
            raise Refused("bad_option", f"{option} is {value:g}", "Give its size, in SI units")
    if options.reference_c is not None and options.sweeps is None:
        raise Refused(
            "bad_option", "--reference-c is for sweeps that were repeated at several temperatures", "Give --sweeps"
        )
    only = _only(options)
    sign, axis = options.up
    x, y, z = ((1.0 if sign == "+" else -1.0) * np.eye(3)["xyz".index(axis)]).tolist()
    said = {"name": options.name, "part": options.part, "serial_number": options.serial_number}
    item = {key: word for key, word in said.items() if word is not None}
    try:
        told = validate(Item, item, "sensor")
    except ValueError as error:
        raise Refused("bad_option", str(error), "Give names of letters and digits, of 40 characters at most") from None
    recorded: datetime | None = options.recorded
    if recorded is not None and recorded.tzinfo is None:
        recorded = recorded.replace(tzinfo=UTC)
    named = _columns(options.columns)
    if options.turns:
        files = Files(options.run, _told_of_turns(options), "turns", told, recorded, named)
    elif options.sweeps is not None:
        files = Files(options.run, options.sweeps, "sweeps", told, recorded, named)
    else:
        files = Files(options.run, options.attitudes, "attitudes", told, recorded, named)
    return build_recording(
        files,
        Site(
            up=(x, y, z),
            gravity_m_s2=options.gravity_m_s2,
            earth_rate_rad_s=None,
            magnetic_field_t=options.field_t,
            magnetic_field_upwards=options.field_upwards,
        ),
        Elsewhere(
            any_mounting=options.any_mounting,
            find_clock=options.estimate_clock_offset,
            exact_rates=options.exact_rates,
            window_s=options.window_s,
            estimator=options.estimator,
            only=only,
        ),
        second_order=options.second_order,
        reference_c=options.reference_c,
    )


def _only(options: Namespace) -> tuple[str, ...]:
    """The sensors to calibrate, all where nothing is said. Raises Refused `bad_option`."""
    from rig.data.installed_kinds import quantities
    from rig.data.quantity import RATE

    known = [each.sensor for each in quantities().values()]
    allowed = known if options.attitudes is not None else [RATE.sensor]
    if wrong := [each for each in options.only if each not in allowed]:
        raise Refused(
            "bad_option",
            f"--only {shorten(wrong[0])} is none of the sensors that are calibrated here",
            f"Give one of: {', '.join(allowed)}",
        )
    return tuple(dict.fromkeys(options.only))


def _columns(path: Path | None) -> "ColumnMap":
    """The map of columns, an empty one where none is given. Raises Refused as `load_as`."""
    from rig.config.column_map import ColumnMap
    from rig.config.load import load_as

    return ColumnMap() if path is None else load_as(ColumnMap, path)


def _told_of_turns(options: Namespace) -> "Columns":
    """What the options say of a session by hand, as a table's row. Raises Refused `bad_option`, `clock_unknown`."""
    import numpy as np

    from rig.estimation.by_hand.session import FACES

    if options.clock_ppm is None:
        raise Refused(
            "clock_unknown",
            "nothing in the readings shows how far their time stamps are off, and the scale factors are off by as much",
            "Say it: --clock-ppm 50 for a crystal; a part's own data rate is some per cent off, and is no clock",
        )
    for name, largest in (("clock_ppm", 1e5), ("squareness_deg", 10.0)):
        if not 0 < getattr(options, name) <= largest:
            option = f"--{name.replace('_', '-')}"
            raise Refused(
                "bad_option", f"{option} is {getattr(options, name):g}", f"Give more than 0, {largest:g} at most"
            )
    told = {
        "clock_ppm": options.clock_ppm,
        "box_rad": np.radians(options.squareness_deg),
        "closure": 0.0 if options.no_closure else 1.0,
        "gravity_m_s2": options.gravity_m_s2,
    }
    if options.first_face is not None:
        told["first_face"] = FACES.index(options.first_face)
    return {name: np.array([value], dtype=np.float64) for name, value in told.items()}


def _kept(options: Namespace, recording: "RunData", outcome: "Outcome") -> "tuple[Beside, ...]":
    """Write the run folder and enter it in the history; its calibrations beside the ones before."""
    from rig.commands.history.remember import remember_own
    from rig.data.latest_run import note_run
    from rig.data.recording.run_file import write_elsewhere
    from rig.data.run_folder import empty_folder, next_recording
    from rig.report.writers import write_outcome
    from rig.station.events import RunFolderWritten
    from rig.station.view import PlainView

    folder, tell = empty_folder(options.out), PlainView().event
    note_run(folder)
    try:
        write_elsewhere(next_recording(folder, "raw"), recording)
        for event in write_outcome(folder, outcome):
            tell(event)
    except OSError as error:
        raise Refused("run_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    tell(RunFolderWritten(folder))
    if options.serial_number is None:
        say("rig: entered in no history: nobody said whose readings these are (--serial-number)", sys.stderr)
        return ()
    entered, beside = remember_own(folder, named_history(options.history))
    if entered is not None:
        tell(entered)
    return beside
