"""Errors that a certificate's uncertainties do not include, quantity by quantity, for its readers."""

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.result_file import GyroscopeEntry

# Statements for every run: a budget covers one temperature, one power-up and one mounting.
ALWAYS = (
    "other temperatures",
    "power cycling",
    "remounting and its stress",
    "vibration that the item rectifies",
    "ageing and transport",
)

# Statement for a motion that a file describes.
OF_THE_FILE = ("the scale of the file's angles and of its time",)


def has_contributor(budget: BudgetEntry | None, name: str) -> bool:
    """Return whether the budget has a contributor whose name contains `name`."""
    return budget is not None and any(name in line.name for line in budget.contributors)


def list_omitted_rates(sensor: GyroscopeEntry, *, external: bool = False) -> str:
    """Return the errors that a gyroscope's U omits; for external motion, also errors that readings do not show."""
    bent = ALWAYS if sensor.nonlinearity is not None else ("nonlinearity at other speeds", *ALWAYS)
    return ", ".join(("the effect of gravity", *OF_THE_FILE, *bent) if external else bent)


def list_omitted_accelerations(entry: AccelerometerEntry) -> str:
    """Return the effects that an accelerometer's U does not include."""
    bent = "nonlinearity" if entry.second_order_s2_m is None else "nonlinearity beyond the second order"
    bent = "nonlinearity beyond 1 g" if has_contributor(entry.budget, "nonlinearity") else bent
    return ", ".join((bent, *ALWAYS))


def list_omitted_fields() -> str:
    """Return the errors that a magnetometer's U omits, without the arm's field, which is stated with the bias."""
    return ", ".join(("nonlinearity", "iron magnetised since", *ALWAYS))
