"""What a certificate's uncertainties leave out, quantity by quantity: nobody should take it for included."""

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.result_file import GyroscopeEntry

# What a budget has of it, it has of the run: a value is that of one temperature, one power-up and one mounting.
ALWAYS = (
    "other temperatures",
    "switching off and on",
    "mounting anew and its stress",
    "vibration that the item rectifies",
    "ageing and transport",
)

# Of a motion that a file tells.
OF_THE_FILE = ("the scale of the file's angles and of its time",)


def in_budget(budget: BudgetEntry | None, name: str) -> bool:
    """Whether a line of that name is in it."""
    return budget is not None and any(name in line.name for line in budget.contributors)


def left_out_of_rates(sensor: GyroscopeEntry, *, elsewhere: bool = False) -> str:
    """What a gyroscope's U leaves out; where a file tells the motion, errors of it that the readings do not show."""
    bent = ALWAYS if sensor.nonlinearity is not None else ("nonlinearity at other speeds", *ALWAYS)
    return ", ".join(("what gravity adds to it", *OF_THE_FILE, *bent) if elsewhere else bent)


def left_out_of_accelerations(entry: AccelerometerEntry) -> str:
    """What an accelerometer's U leaves out."""
    bent = "nonlinearity" if entry.second_order_s2_m is None else "nonlinearity beyond the second order"
    bent = "nonlinearity beyond gravity's size" if in_budget(entry.budget, "nonlinearity") else bent
    return ", ".join((bent, *ALWAYS))


def left_out_of_fields() -> str:
    """What a magnetometer's U leaves out; what it reads of the arm is told beside its bias."""
    return ", ".join(("nonlinearity", "iron magnetised since", *ALWAYS))
