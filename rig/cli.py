"""The command line: its commands, each imported only when it is called, so that help comes at once."""

import argparse
import gc
import os
import re
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from rig.commands.command_signals import end_by_interrupt, ignore_endings
from rig.commands.standard_streams import keep_streams_usable, output_lost
from rig.data.version import VERSION
from rig.errors import INTERRUPTED_STATUS, Fault, RigError, Unprinted
from rig.errors.quoting import printable, printable_lines
from rig.station.plain_text import format_for_file, say_on_terminal

if TYPE_CHECKING:
    from rig.plans.procedure_registry import AnyProcedure

# The rig's linear algebra is small: threads slow it down, most of all on a busy machine. NumPy reads these variables
# when it is loaded. Values that the user has set stay, and so does NumPy in a program that has already loaded it.
if "numpy" not in sys.modules:
    for _library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
# No package that extends pydantic changes the rig: to look for one in all that is installed takes 10 ms.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

# Imported modules live as long as the process: to search them for garbage takes a tenth of a short command, which makes
# 150,000 containers at most.
_GARBAGE_THRESHOLD = 200_000  # container objects


class Command(NamedTuple):
    """A command: its module (`add` adds its arguments, `run` carries it out), its help line, and its page in docs.

    `waits_for`: the line that a command prints at once if it begins by loading libraries for a second.
    """

    module: str
    text: str
    page: str
    waits_for: str = ""


COMMANDS = {
    "demo": Command(
        "rig.commands.measure.demo",
        "run a calibration in a simulated laboratory, without any hardware",
        "how-to/start/ten-minutes.md",
        "reading the configuration",
    ),
    "new": Command(
        "rig.commands.devices.new",
        "write a configuration from a few questions, with comments, checked",
        "how-to/start/own-imu.md",
    ),
    "run": Command(
        "rig.commands.measure.run",
        "run the calibration that the file describes",
        "how-to/start/first-calibration.md",
        "reading the configuration",
    ),
    "plan": Command(
        "rig.commands.measure.plan",
        "dry run: every motion, its time and limits; connects to nothing",
        "how-to/at-the-rig/no-longer-than-needed.md",
        "reading the configuration",
    ),
    "check": Command(
        "rig.commands.measure.check_devices",
        "connect and check; nothing moves, no program is stopped",
        "how-to/start/first-calibration.md",
        "reading the configuration",
    ),
    "record": Command(
        "rig.commands.measure.record",
        "record only the sensors, while another device turns them; nothing moves",
        "how-to/without-an-arm/known-attitudes.md",
    ),
    "resume": Command(
        "rig.commands.measure.resume",
        "go on with an interrupted run",
        "how-to/at-the-rig/resume-and-repeat.md",
        "reading the run",
    ),
    "station": Command(
        "rig.commands.station.station",
        "calibrate one part after the other: number, checks, run, verdict, label",
        "how-to/at-the-rig/station.md",
        "reading the configuration",
    ),
    "floor": Command(
        "rig.commands.station.floor",
        "show in a browser the state of several rigs that share a history",
        "how-to/at-the-rig/station.md",
    ),
    "watch": Command(
        "rig.commands.station.watch", "replay a recorded run in a browser", "how-to/at-the-rig/operators-page.md"
    ),
    "solve": Command(
        "rig.commands.offline.solve",
        "recompute the calibration from a recording, or from samples of another program",
        "how-to/without-an-arm/data-recorded-elsewhere.md",
        "reading the recording",
    ),
    "allan": Command(
        "rig.commands.offline.allan",
        "random walk and bias instability, by the Allan deviation of a recording at rest",
        "how-to/at-the-rig/bias-drift.md",
        "reading the recording",
    ),
    "look": Command(
        "rig.commands.offline.look",
        "what a log of another program holds, which solutions it allows, and the map of its columns",
        "how-to/without-an-arm/from-a-robots-log.md",
        "reading the file",
    ),
    "reversal": Command(
        "rig.commands.offline.reversal",
        "a magnetometer's own bias, from runs between which it was turned over",
        "how-to/at-the-rig/magnetometers.md",
    ),
    "show": Command(
        "rig.commands.documents.show",
        "show the result of a finished run: values, budgets, checks",
        "how-to/finished-runs/read-a-certificate.md",
        "reading the result",
    ),
    "explain": Command(
        "rig.commands.documents.explain",
        "explain a check, an error, a limit or a word, and say what to do",
        "how-to/start/failed.md",
    ),
    "report": Command(
        "rig.commands.documents.report",
        "write the certificate of a finished run: HTML, PDF, digital certificate",
        "how-to/finished-runs/read-a-certificate.md",
        "reading the result",
    ),
    "verify": Command(
        "rig.commands.documents.verify",
        "check who signed a certificate and when, whether it is unchanged, and whether it is in a history",
        "how-to/finished-runs/signed-certificates.md",
        "looking at the signatures",
    ),
    "export": Command(
        "rig.commands.documents.export",
        "write calibrations and readings in the formats of other programs",
        "how-to/finished-runs/export.md",
        "reading the run",
    ),
    "history": Command(
        "rig.commands.history.command",
        "the history of the laboratory: calibrations, trends, check standards",
        "how-to/finished-runs/check-standards.md",
        "opening the history",
    ),
    "study": Command(
        "rig.commands.offline.study",
        "run a Monte-Carlo study of the papers' figures and tables; without a name, list them",
        "how-to/with-code/studies.md",
        "loading the studies",
    ),
    "board": Command(
        "rig.commands.devices.board",
        "inspect the board, read and change its stored calibrations, flash its firmware",
        "board.md",
    ),
    "kvh": Command("rig.commands.devices.kvh", "inspect a KVH 1775", "how-to/at-the-rig/kvh1775.md"),
    "autopilot": Command(
        "rig.commands.devices.autopilot",
        "write a calibration into an autopilot's parameters, or restore the old ones",
        "how-to/at-the-rig/autopilot.md",
    ),
    "lines": Command(
        "rig.commands.devices.lines",
        "inspect a device that prints lines, and write its section or a complete configuration by hand",
        "how-to/at-the-rig/lines.md",
    ),
    "world": Command(
        "rig.commands.laboratory.world",
        "run only the simulated laboratory, in the foreground, for any client",
        "how-to/with-code/laboratory-ci.md",
    ),
}
FIRST_STEPS = """\
Calibrates inertial sensors on a robot arm, a servomotor or by hand. First steps:

  rig demo                a calibration in a simulated laboratory; ten seconds
  rig new my.yaml         write a configuration from a few questions
  rig plan CONFIG         what the arm will do, and how long; connects to nothing
  rig check CONFIG        devices present and missing, before a run on hardware; nothing moves
  rig run CONFIG          the calibration
  rig show latest         the result of the latest run
  rig report latest       its certificate
  rig history             every calibration so far

rig --help names all commands, rig COMMAND --help what each takes."""
PAGES = "docs/README.md"
FAULT = Fault.exit_status


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `rig` and return the exit status that docs/architecture.md defines (0 to 5, or 130)."""
    gc.set_threshold(_GARBAGE_THRESHOLD)
    keep_streams_usable()  # help too is read by `head`, and by terminals without the character °
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["history"]:
        from rig.commands.history.command import insert_usual_command

        words = insert_usual_command(words)
    if not words and "_ARGCOMPLETE" not in os.environ:
        return run_guarded(_first_steps)
    meant = _first_word(os.environ["COMP_LINE"].split()[1:] if "_ARGCOMPLETE" in os.environ else words)
    parser = _build_parser(meant)
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser)
    options, not_understood = parser.parse_known_args(words)
    if not_understood:
        hint = "--set takes one word without blanks, as in --set procedure.speed_deg_s=30; " if "--set" in words else ""
        parser.error(f"{hint}unrecognized arguments: {' '.join(not_understood)}")
    return run_guarded(lambda: _carry_out(meant, options.command, options))


def _first_word(words: Sequence[str]) -> str | None:
    """Return the name of the command: the first word that is not an option, or None."""
    return next((word for word in words if not word.startswith("-")), None)


def _first_steps() -> int:
    from rig.config.files.supplied_files import locate_supplied

    print(FIRST_STEPS + (f" Step by step: {PAGES}." if locate_supplied(PAGES).exists() else ""))
    return 0


def _carry_out(name: str | None, command: Callable[[argparse.Namespace], int], options: argparse.Namespace) -> int:
    """Carry out a command. Its first line of progress is printed before its modules are loaded."""
    if name is not None and COMMANDS[name].waits_for:
        say_on_terminal(COMMANDS[name].waits_for)
    return command(options)


def run_guarded(command: Callable[[], int]) -> int:
    """Run a command and return its exit status; print a named error as one message on stderr."""
    keep_streams_usable()
    end_by_interrupt()
    try:
        status = command()
        if (lost := output_lost()) is not None:
            what = f"the work is done, but stdout has lost the output ({lost.strerror or lost})"
            raise Unprinted("output_lost", what, "Free some space, or redirect the output to another disk")
        return status
    except RigError as error:
        return _print_ending(
            "\n".join([str(error), *map(printable, getattr(error, "__notes__", ()))]), error.exit_status
        )
    except KeyboardInterrupt as interrupt:
        ignore_endings()  # all is stopped: an impatient second Ctrl-C has nothing to end
        if sys.stdin.isatty() and sys.stderr.isatty():
            print(file=sys.stderr)  # the terminal shows ^C behind what stood in the line
        return _print_ending(str(interrupt) or "interrupted", INTERRUPTED_STATUS)
    except OSError as error:
        return _print_ending(
            str(Fault("system", f"the system refused ({error})", "Correct that, then try again")), FAULT
        )
    except SystemExit as ended:  # raised by a script's own code: its status would be taken for a verdict
        ended_by = f"a script ended the program (SystemExit: {ended})"
        return _print_ending(
            str(Fault("script_failed", ended_by, "Remove from the script what ends the program")), FAULT
        )
    except BaseException:
        import traceback

        traceback.print_exc()  # a defect of rig; Python's own status, 1, would mean a verdict
        return FAULT


def _print_ending(text: str, status: int) -> int:
    print(format_for_file(f"rig: {printable_lines(text)}", sys.stderr), file=sys.stderr)
    return status


class _Parser(argparse.ArgumentParser):
    """A parser that prints an error in one line before the usage, with the choice that may have been meant."""

    def error(self, message: str) -> NoReturn:
        """Print the error, the command's usage and how to get help; exit with status 2."""
        usage = self.format_usage()
        self.exit(2, f"{self.prog}: error: {printable(_suggest_choice(message))}\n{usage}more: {self.prog} --help\n")


def _suggest_choice(message: str) -> str:
    """Return argparse's message on a wrong choice as a sentence, with the nearest valid choice."""
    wrong = re.fullmatch(r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", message)
    if wrong is None:
        return message
    from difflib import get_close_matches

    name, word, choices = wrong.groups()
    commands = [choice.strip(" '") for choice in choices.split(",")]
    what = f"there is no command {word}" if name == "COMMAND" else f"{name} cannot be {word}"
    nearest = get_close_matches(word, commands, n=2)
    return f"{what}; " + (f"did you mean {' or '.join(nearest)}?" if nearest else f"there are {', '.join(commands)}")


def _build_parser(meant: str | None) -> argparse.ArgumentParser:
    """Return a parser of all commands; only the one called `meant` has its arguments."""
    parser = _Parser(prog="rig", description="Calibrate inertial sensors on a robot arm, a servomotor or by hand.")
    parser.add_argument("--version", action="version", version=f"rig {VERSION}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        added = commands.add_parser(name, help=command.text, description=command.text)
        if name == meant:
            module = import_module(command.module)
            module.add(added)
            added.set_defaults(command=module.run)
    return parser


def run_script(procedure: "AnyProcedure") -> int:
    """Run a script that is called as `python FILE.py` and defines `procedure`; it takes the arguments of `rig run`.

    The script's procedure replaces the one that the configuration names.
    """
    from rig.commands.measure.run import add, run
    from rig.plans.script_file import script_in

    script = sys.modules["__main__"]
    parser = argparse.ArgumentParser(description=script.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add(parser, script=False)
    options = parser.parse_args()
    options.script = script_in(script, procedure)
    return run_guarded(lambda: run(options))
