"""A driver for a calibration rig: a robot arm turns a board of inertial sensors and solves for their calibration.

In a notebook:

    import rig
    run = rig.load("runs/2026-11-21T10-00-00Z-six_observation")   # a run folder or a run.h5
    t, rate = run["gyro"].on_arm_clock()                          # (n,) s, (n, 3) rad/s
    result = rig.solve(run)
    result["gyro"].scale, result["gyro"].std
    result.plot()
    rig.compare(run, "gyro", "reference").plot()

These names are the public ones; where they are made may change. To import them loads no arm driver.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig.errors import Fault, Refused
    from rig.history.store import open_history
    from rig.notebook.comparisons import SensorComparison, compare
    from rig.notebook.results import Calibration, Result, solve
    from rig.notebook.runs import Readings, Run, load

__version__ = "0.1.0"
__all__ = [
    "Calibration",
    "Fault",
    "Readings",
    "Refused",
    "Result",
    "Run",
    "SensorComparison",
    "__version__",
    "compare",
    "load",
    "open_history",
    "solve",
]

_PLACES = {
    **dict.fromkeys(("Fault", "Refused"), "rig.errors"),
    "open_history": "rig.history.store",
    **dict.fromkeys(("SensorComparison", "compare"), "rig.notebook.comparisons"),
    **dict.fromkeys(("Calibration", "Result", "solve"), "rig.notebook.results"),
    **dict.fromkeys(("Readings", "Run", "load"), "rig.notebook.runs"),
}


def __getattr__(name: str) -> Any:
    """The public functions, each imported when it is first asked for: the command line starts without them."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return __all__
