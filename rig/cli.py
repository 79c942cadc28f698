"""The command line: which commands there are. Each is imported when it is meant, so that help comes at once."""

import argparse
import gc
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from rig.commands.endings import end_by_interrupt, ignore_endings
from rig.commands.standard_streams import keep_streams_usable, output_lost
from rig.data.version import VERSION
from rig.errors import Fault, RigError, Unprinted
from rig.errors.quoting import printable_lines
from rig.station.plain_text import for_file, say_on_terminal

if TYPE_CHECKING:
    from rig.plans.registry import AnyProcedure

# The rig's linear algebra is small: threads only get in its way, most of all on a busy machine. NumPy asks when it is
# loaded, so this must be said before; whoever has said otherwise is heeded, and so is a program that has NumPy already.
if "numpy" not in sys.modules:
    for _library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

# What is imported lives as long as the process: to look through it for garbage takes a tenth of a short command.
_COLLECTED_AFTER = 50_000  # objects that hold others

# Of each its module, in which `add` says what it takes and `run` does it, and its help line.
_COMMANDS = {
    "demo": ("rig.commands.measure.demo", "a calibration in a simulated laboratory, without any hardware"),
    "run": ("rig.commands.measure.run", "run the procedure the file names"),
    "plan": ("rig.commands.measure.plan", "dry run: every motion, its time and limits; connects to nothing"),
    "check": ("rig.commands.measure.check", "connect and look; nothing moves, no program is stopped"),
    "record": (
        "rig.commands.measure.record",
        "record the sensors alone, while something else turns them; nothing moves",
    ),
    "resume": ("rig.commands.measure.resume", "go on with an interrupted run"),
    "station": ("rig.commands.station.station", "one part after the other: number, checks, run, verdict, label"),
    "floor": ("rig.commands.station.floor", "what several rigs that share a history do now, in a browser"),
    "watch": ("rig.commands.station.watch", "a recorded run in a browser, as it was"),
    "solve": ("rig.commands.offline.solve", "recompute the calibration from a recording"),
    "allan": (
        "rig.commands.offline.allan",
        "random walk and bias instability, by the Allan deviation of what was recorded at rest",
    ),
    "reversal": (
        "rig.commands.offline.reversal",
        "a magnetometer's own bias, from runs between which it was turned over",
    ),
    "show": ("rig.commands.documents.show", "what a finished run amounts to: values, budgets, checks"),
    "explain": ("rig.commands.documents.explain", "what a check, an error, a limit or a word means, and what to do"),
    "report": ("rig.commands.documents.report", "the certificate of a finished run: HTML, PDF, digital certificate"),
    "verify": (
        "rig.commands.documents.verify",
        "who signed a certificate, when, whether it is unchanged, and whether a history knows it",
    ),
    "export": ("rig.commands.documents.export", "what was calibrated and recorded, in the files of other programs"),
    "history": ("rig.commands.history.command", "what the laboratory remembers: calibrations, trends, check standards"),
    "study": (
        "rig.commands.offline.study",
        "Monte-Carlo studies of the papers' figures and tables; without a name, list them",
    ),
    "board": (
        "rig.commands.devices.board",
        "look at the board, read and change its stored calibrations, flash its firmware",
    ),
    "kvh": ("rig.commands.devices.kvh", "look at a KVH 1775"),
    "autopilot": (
        "rig.commands.devices.autopilot",
        "write a calibration into an autopilot's parameters, and bring the old ones back",
    ),
    "lines": (
        "rig.commands.devices.lines",
        "look at a device that prints lines, and write its section of a configuration",
    ),
    "world": ("rig.commands.laboratory.world", "only the simulated laboratory, in the foreground, for any client"),
}
_AT_ONCE = {  # what a command that begins by loading libraries for a second says before
    "demo": "reading the configuration",
    "run": "reading the configuration",
    "plan": "reading the configuration",
    "check": "reading the configuration",
    "resume": "reading the run",
    "station": "reading the configuration",
    "solve": "reading the recording",
    "allan": "reading the recording",
    "report": "reading the result",
    "show": "reading the result",
    "verify": "looking at the signatures",
    "export": "reading the run",
    "history": "opening the history",
    "study": "loading the studies",
}
FIRST_STEPS = """\
Calibrates inertial sensors on a robot arm. What one does first:

  rig plan configs/demo.yaml    what the arm will do, and how long; connects to nothing
  rig run configs/demo.yaml     a calibration; this one in a simulated laboratory
  rig check CONFIG              what is there and what is missing, before a run on hardware; nothing moves
  rig report RUN                the certificate of a finished run
  rig history                   every calibration so far

rig --help names all commands, rig COMMAND --help what each takes. Step by step: docs/README.md."""
FAULT, INTERRUPTED = Fault.exit_status, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `rig`; returns the exit status docs/architecture.md promises (0 to 5, or 130)."""
    gc.set_threshold(_COLLECTED_AFTER)
    keep_streams_usable()  # help too is read by `head`, and by terminals that know no °
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["history"]:
        from rig.commands.history.command import with_usual_command

        words = with_usual_command(words)
    meant = next((word for word in words if not word.startswith("-")), None)
    if not words:
        return guarded(_first_steps)
    parser = _parser(meant)
    options, not_understood = parser.parse_known_args(words)
    if not_understood:
        hint = "--set takes one word without blanks, as in --set procedure.speed_deg_s=30; " if "--set" in words else ""
        parser.error(f"{hint}unrecognized arguments: {' '.join(not_understood)}")
    return guarded(lambda: _begun(meant, options.command, options))


def _first_steps() -> int:
    print(FIRST_STEPS)
    return 0


def _begun(name: str | None, command: Callable[[argparse.Namespace], int], options: argparse.Namespace) -> int:
    """Carry out a command; there is a sign of life before what it needs is loaded."""
    if name in _AT_ONCE:
        say_on_terminal(_AT_ONCE[name])
    return command(options)


def guarded(command: Callable[[], int]) -> int:
    """Run a command; turn every named error into one message on stderr and its exit status."""
    keep_streams_usable()
    end_by_interrupt()
    try:
        status = command()
        if (lost := output_lost()) is not None:
            what = f"all is done, but stdout has not taken what was to be printed ({lost.strerror or lost})"
            raise Unprinted("output_lost", what, "Make room, or print into another place")
        return status
    except RigError as error:
        return _ended(str(error), error.exit_status)
    except KeyboardInterrupt as interrupt:
        ignore_endings()  # all is stopped: an impatient second one has nothing left to end
        return _ended(str(interrupt) or "interrupted", INTERRUPTED)
    except OSError as error:
        return _ended(str(Fault("system", f"the system refused ({error})", "Correct that, then try again")), FAULT)
    except SystemExit as ended:  # what a script's own code raised: its status would be taken for a verdict
        ended_by = f"a script ended the program (SystemExit: {ended})"
        return _ended(str(Fault("script_failed", ended_by, "Remove from the script what ends the program")), FAULT)
    except BaseException:
        import traceback

        traceback.print_exc()  # a defect of ours; Python's own status, 1, would mean a verdict
        return FAULT


def _ended(text: str, status: int) -> int:
    print(for_file(f"rig: {printable_lines(text)}", sys.stderr), file=sys.stderr)
    return status


def _parser(meant: str | None) -> argparse.ArgumentParser:
    """Every command by its name, and the arguments of the one that is meant."""
    parser = argparse.ArgumentParser(prog="rig", description="Calibrate inertial sensors on a robot arm.")
    parser.add_argument("--version", action="version", version=f"rig {VERSION}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, (module_name, text) in _COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if name == meant:
            module = import_module(module_name)
            module.add(command)
            command.set_defaults(command=module.run)
    return parser


def run_script(procedure: "AnyProcedure") -> int:
    """Entry point of a script that is run as `python FILE.py` and defines `procedure`; arguments as of `rig run`.

    It is this procedure that runs, whatever the configuration names.
    """
    from rig.commands.measure.run import add, run
    from rig.plans.script_file import script_in

    script = sys.modules["__main__"]
    parser = argparse.ArgumentParser(description=script.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add(parser, script=False)
    options = parser.parse_args()
    options.script = script_in(script, procedure)
    return guarded(lambda: run(options))
