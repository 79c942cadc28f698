"""`rig reversal`: a magnetometer's own bias, from runs with the sensor turned over on its extension between them."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_json, add_run
from rig.commands.report_folder import refuse_unwritable


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig reversal`."""
    add_run(parser, "runs", "run folders, or their run.h5: two or three", nargs="+")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the JSON to this file too")
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the biases that the runs together determine, and write them to `--out`.

    Return 0. Raise Refused `report_folder`, and any Refused or Fault that `open_run`, `turner_of`, `judge_phases` and
    `reversals` raise.
    """
    from rig.analysis.reversal import reversals
    from rig.config.files.safe_writing import write_new
    from rig.observation.motion.arm_motion import turner_of
    from rig.plans.recorded_run import judge_phases, open_run
    from rig.report.terminal.reversal import print_reversal, reversal_document

    opened = [(str(path), open_run(path)) for path in options.runs]
    for _, run in opened:
        turner_of(run.movement[0])
    document = reversal_document(reversals([(name, judge_phases(run)) for name, run in opened]))
    print_reversal(document, as_json=options.json)
    if options.out is not None:
        with refuse_unwritable(options.out):
            write_new(options.out, document.text() + "\n")
    return 0
