"""`rig solve SAMPLES.csv --sweeps|--attitudes FILE` or `--turns`: readings of other programs, solved like a run."""

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_columns, add_history, read_column_map, read_history_name
from rig.errors import Refused, raise_as
from rig.errors.quoting import shorten
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.outcome import Outcome
    from rig.commands.history.remember import CalibrationComparison
    from rig.data.recording.motion_file import Columns, MotionKind
    from rig.data.recording.run_data import RunData

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")


def add(solve: ArgumentParser) -> None:
    """Add the arguments for readings of other programs."""
    group = solve.add_argument_group("with --sweeps, --attitudes or --turns")
    add_columns(group)
    group.add_argument("--out", type=Path, metavar="DIR", help="new run folder for result, certificate, pictures")
    group.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="SENSOR",
        help="calibrate only this sensor of those in the file: gyroscope, accelerometer, magnetometer; may be repeated",
    )
    add_history(group)
    group.add_argument("--name", default="imu", metavar="NAME", help="name of the sensor (default: imu)")
    group.add_argument("--part", metavar="PART", help="part number of the sensor")
    group.add_argument("--serial-number", metavar="NUMBER", help="serial number of the sensor; a history needs it")
    group.add_argument(
        "--recorded",
        type=_read_time,
        metavar="TIME",
        help="time of the readings (2026-11-25T08:30, UTC; default: when their file was last written)",
    )
    sweep_group = solve.add_argument_group("with --sweeps")
    sweep_group.add_argument(
        "--reference-c",
        type=float,
        metavar="CELSIUS",
        help="calibrate over temperature: the sweeps are repeated at several temperatures (column temperature_c); "
        "results that do not depend on temperature are stated at this one",
    )
    turn_group = solve.add_argument_group("with --turns")
    turn_group.add_argument(
        "--clock-ppm",
        type=float,
        metavar="PPM",
        help="largest error of the time stamps' rate (20 to 50 for a crystal); required because no reading shows it",
    )
    turn_group.add_argument(
        "--squareness-deg",
        type=float,
        default=0.2,
        metavar="DEG",
        help="largest error of the faces' squareness (default: 0.2)",
    )
    turn_group.add_argument(
        "--no-closure", action="store_true", help="turns on a face were not made against a straight edge"
    )
    turn_group.add_argument(
        "--first-face", choices=AXES, help="axis that pointed upwards at first; required without an accelerometer"
    )
    attitude_group = solve.add_argument_group("with --attitudes")
    attitude_group.add_argument(
        "--gravity-m-s2",
        type=float,
        default=STANDARD_GRAVITY_M_S2,
        metavar="G",
        help="local gravity (default: the standard 9.80665); scale factors are relative to it",
    )
    attitude_group.add_argument(
        "--up", default="+z", choices=AXES, help="axis of the table that points roughly upwards (default: +z)"
    )
    attitude_group.add_argument(
        "--field-t", type=float, metavar="B", help="strength of the magnetic field, for a magnetometer"
    )
    attitude_group.add_argument("--field-upwards", action="store_true", help="the magnetic field rises from the ground")
    attitude_group.add_argument(
        "--any-mounting", action="store_true", help="the sensor's axes need not lie along the body's"
    )
    attitude_group.add_argument(
        "--estimate-clock-offset",
        action="store_true",
        help="estimate the attitudes' clock offset from the rotation in both files",
    )
    attitude_group.add_argument(
        "--exact-rates",
        action="store_true",
        help="solve the gyroscope by the attitudes' rates, exact as those of a rate table, not by increments",
    )
    attitude_group.add_argument(
        "--window-s",
        type=float,
        metavar="SECONDS",
        help="averaging time of attitudes for a gyroscope's increments (default: 1, less for short recordings)",
    )
    attitude_group.add_argument(
        "--second-order", action="store_true", help="estimate the accelerometer's second-order terms too"
    )


def _read_time(text: str) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a time; write it as 2026-11-25T08:30") from None


def refuse_for_recording(options: Namespace) -> None:
    """Raise Refused `bad_option` if a recording of the rig is to be solved with an option for other readings."""
    of_others = ArgumentParser(add_help=False)
    add(of_others)
    for name, default in vars(of_others.parse_args([])).items():
        if getattr(options, name) != default:
            option = f"--{name.replace('_', '-')}"
            what = f"{option} is for samples of another program; a recording has its own settings"
            raise Refused("bad_option", what, f"Leave {option} out, or give --attitudes, --sweeps or --turns too")


def run(options: Namespace) -> int:
    """Solve the readings and print the result; with `--out` also write a run folder and enter it in the history.

    Return 0, or 1 if a check failed. Raise Refused `bad_option`, `run_folder`, and what `build_recording` and the
    solution raise.
    """
    from rig.analysis.analyses import calibrate
    from rig.commands.history.remember import describe_changes
    from rig.commands.standard_streams import say_where_the_result_is
    from rig.data.run_folder import RESULT
    from rig.report.document import document_of
    from rig.report.terminal.result_table import print_kept, print_outcome

    if options.history is not None and options.out is None:
        raise Refused("bad_option", "--history is for runs that are kept", "Give --out, which keeps the run")
    with raise_as(Refused):  # no arm moves: wrong data is a refusal, not a fault
        recording = _build_recording(options)
        outcome = calibrate([recording])
    comparisons = () if options.out is None else _keep_run(options, recording, outcome)
    result = document_of(outcome)
    if options.out is None or options.all:
        print_outcome(result, as_json=options.json, whole=options.all)
    else:
        print_kept(options.out, result, describe_changes(comparisons), as_json=options.json)
    if options.out is not None:
        say_where_the_result_is(options.out / RESULT)
    return 0 if outcome.passed else 1


def _build_recording(options: Namespace) -> "RunData":
    """Return the recording of the options' files. Raise Refused `bad_option` for an impossible value."""
    from rig.data.recording.motion_file import Item
    from rig.data.recording.settings import Site, SolveOptions
    from rig.data.validation import validate
    from rig.estimation.arrays import axis_of
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
    only = _sensors_to_calibrate(options)
    x, y, z = axis_of(options.up).tolist()
    named_values = {"name": options.name, "part": options.part, "serial_number": options.serial_number}
    given_item = {key: value for key, value in named_values.items() if value is not None}
    try:
        item = validate(Item, given_item, "sensor")
    except ValueError as error:
        raise Refused("bad_option", str(error), "Give names of letters and digits, of 40 characters at most") from None
    recorded: datetime | None = options.recorded
    if recorded is not None and recorded.tzinfo is None:
        recorded = recorded.replace(tzinfo=UTC)
    # A day is allowed for a clock in local time.
    if recorded is not None and recorded > datetime.now(UTC) + timedelta(days=1):
        what = f"--recorded is {recorded:%Y-%m-%dT%H:%M} UTC, which is in the future"
        raise Refused("bad_option", what, "Give the time of the readings; correct this computer's clock if it is slow")
    column_map = read_column_map(options.columns)
    tells: MotionKind = "turns" if options.turns else "attitudes" if options.sweeps is None else "sweeps"
    motion = _read_turn_options(options) if options.turns else options.sweeps or options.attitudes
    return build_recording(
        Files(options.run, motion, tells, item, recorded, column_map),
        Site(
            up=(x, y, z),
            gravity_m_s2=options.gravity_m_s2,
            earth_rate_rad_s=None,
            magnetic_field_t=options.field_t,
            magnetic_field_upwards=options.field_upwards,
        ),
        SolveOptions(
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


def _sensors_to_calibrate(options: Namespace) -> tuple[str, ...]:
    """Return the sensors of the option `--only`, empty for all. Raise Refused `bad_option`."""
    from rig.data.installed_kinds import quantities
    from rig.data.quantity import RATE

    sensors = [quantity.sensor for quantity in quantities().values()]
    allowed = sensors if options.attitudes is not None else [RATE.sensor]
    if wrong := [sensor for sensor in options.only if sensor not in allowed]:
        raise Refused(
            "bad_option",
            f"--only {shorten(wrong[0])} is not a sensor that is calibrated here",
            f"Give one of: {', '.join(allowed)}",
        )
    return tuple(dict.fromkeys(options.only))


def _read_turn_options(options: Namespace) -> "Columns":
    """Return the options of a session by hand as columns of one row. Raise Refused `bad_option`, `clock_unknown`."""
    import numpy as np

    from rig.estimation.by_hand.session_parts import FACES

    if options.clock_ppm is None:
        raise Refused(
            "clock_unknown",
            "no reading shows the error of the time stamps' rate, but the scale factors have the same relative error",
            "State it: --clock-ppm 50 for a crystal. A part's own data rate is wrong by a few per cent and cannot "
            "serve as a clock",
        )
    for name, largest in (("clock_ppm", 1e5), ("squareness_deg", 10.0)):
        if not 0 < getattr(options, name) <= largest:
            option = f"--{name.replace('_', '-')}"
            raise Refused(
                "bad_option", f"{option} is {getattr(options, name):g}", f"Give more than 0 and at most {largest:g}"
            )
    values = {
        "clock_ppm": options.clock_ppm,
        "box_rad": np.radians(options.squareness_deg),
        "closure": 0.0 if options.no_closure else 1.0,
        "gravity_m_s2": options.gravity_m_s2,
    }
    if options.first_face is not None:
        values["first_face"] = FACES.index(options.first_face)
    return {name: np.array([value], dtype=np.float64) for name, value in values.items()}


def _keep_run(options: Namespace, recording: "RunData", outcome: "Outcome") -> "tuple[CalibrationComparison, ...]":
    """Write the run folder and enter it in the history. Return the comparisons with earlier calibrations."""
    from rig.commands.history.remember import remember_own
    from rig.data.latest_run import note_run
    from rig.data.recording.run_file import write_elsewhere
    from rig.data.run_folder import empty_folder, next_recording, refuse_unwritable
    from rig.report.writers import write_outcome
    from rig.station.events import RunFolderWritten
    from rig.station.view import PlainView

    folder, tell = empty_folder(options.out), PlainView().event
    note_run(folder)
    with refuse_unwritable(folder):
        write_elsewhere(next_recording(folder, "raw"), recording)
        for event in write_outcome(folder, outcome):
            tell(event)
    tell(RunFolderWritten(folder))
    if options.serial_number is None:
        say("rig: not entered in a history: --serial-number is not given", sys.stderr)
        return ()
    entered, comparisons = remember_own(folder, read_history_name(options.history))
    if entered is not None:
        tell(entered)
    return comparisons
