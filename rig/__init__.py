"""A driver for a calibration rig: it lets a robot arm turn a board of inertial sensors, and computes their calibration.

In a notebook:

    import rig
    run = rig.load("runs/2026-11-21T10-00-00Z-six_observation")   # a run folder or a run.h5
    t, rate = run["gyro"].on_arm_clock()                          # (n,) s, (n, 3) rad/s
    run["gyro"].to_frame(sweep=3)                                 # pandas, SI units in the names
    result = rig.solve(run)                                       # or rig.load_result(run.path)
    result["gyro"].scale, result["gyro"].scale_expanded           # ± U
    result["gyro"].apply(readings)                                # (n, 3) rad/s, your own
    rig.read_log("log.csv", "columns.yaml").to_frame()            # a log of another program, in SI units
    rig.changes(rig.load("runs/of_last_year"), run)               # E_n
    rig.calibrations("LSM9DS1-001").to_frame()                    # a sensor's, from the history

docs/how-to/with-code/notebook.md goes through it. These names are public; the modules that define them may change.
Importing them loads no arm driver. A refusal raises `Refused`, a failure `Fault`: docs/errors.md lists their names.
"""

from typing import TYPE_CHECKING, Any

from rig.data.version import VERSION

if TYPE_CHECKING:
    from rig.commands.from_python import check, export, plan, run, write_certificate
    from rig.errors import Fault, Refused
    from rig.history.store import open_history
    from rig.notebook.calibrations import Calibration
    from rig.notebook.comparisons import SensorComparison, compare
    from rig.notebook.notebook_history import Calibrations, Changes, SensorChanges, calibrations, changes
    from rig.notebook.readings import Readings, Signal
    from rig.notebook.results import Result, load_result, solve
    from rig.notebook.runs import Run, load, read_log
    from rig.report.terminal.plan_table import DryRun

__version__ = VERSION
__all__ = [
    "Calibration",
    "Calibrations",
    "Changes",
    "DryRun",
    "Fault",
    "Readings",
    "Refused",
    "Result",
    "Run",
    "SensorChanges",
    "SensorComparison",
    "Signal",
    "__version__",
    "calibrations",
    "changes",
    "check",
    "compare",
    "export",
    "load",
    "load_result",
    "open_history",
    "plan",
    "read_log",
    "run",
    "solve",
    "write_certificate",
]

_PLACES = {
    **dict.fromkeys(("check", "export", "plan", "run", "write_certificate"), "rig.commands.from_python"),
    **dict.fromkeys(("Fault", "Refused"), "rig.errors"),
    "open_history": "rig.history.store",
    "Calibration": "rig.notebook.calibrations",
    **dict.fromkeys(("SensorComparison", "compare"), "rig.notebook.comparisons"),
    **dict.fromkeys(
        ("Calibrations", "Changes", "SensorChanges", "calibrations", "changes"), "rig.notebook.notebook_history"
    ),
    **dict.fromkeys(("Readings", "Signal"), "rig.notebook.readings"),
    **dict.fromkeys(("Result", "load_result", "solve"), "rig.notebook.results"),
    **dict.fromkeys(("Run", "load", "read_log"), "rig.notebook.runs"),
    "DryRun": "rig.report.terminal.plan_table",
}


def __getattr__(name: str) -> Any:
    """Return a public name, imported when it is first used, so that the command line starts without it."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return __all__
