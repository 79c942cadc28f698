"""What a certificate's uncertainties leave out, quantity by quantity: nobody should take it for included."""

from collections.abc import Sequence

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import BudgetEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import SensorEntry

NONLINEARITY = "nonlinearity"
# What no budget holds: a value is that of one temperature, one power-up and one mounting.
ALWAYS = ("other temperatures", "switching off and on", "mounting anew and its stress", "ageing and transport")
# What each is called in words. A budget with a line of that name has it in, and it is not left out.
UNLESS_IN_BUDGET = {"vibration": "vibration that the item rectifies"}


def in_budget(budget: BudgetEntry | None, name: str) -> bool:
    """Whether a line of that name is in it."""
    return budget is not None and any(name in line.name for line in budget.contributors)


def left_out_of_rates(sensor: SensorEntry) -> str:
    """Of a gyroscope's U."""
    straight = [] if sensor.nonlinearity is not None else ["nonlinearity at other speeds"]
    return _left_out(sensor.budget, {}, straight)


def left_out_of_accelerations(found: AccelerometerEntry) -> str:
    """Of an accelerometer's U."""
    bent = "nonlinearity" if found.second_order_s2_m is None else "nonlinearity beyond the second order"
    return _left_out(found.budget, {NONLINEARITY: bent})


def left_out_of_fields(found: MagnetometerEntry) -> str:
    """Of a magnetometer's U; what it reads of the arm is told beside its bias."""
    return _left_out(found.budget, {NONLINEARITY: "nonlinearity", "magnetised": "iron magnetised since"})


def _left_out(budget: BudgetEntry | None, more: dict[str, str], always: Sequence[str] = ()) -> str:
    some = [words for name, words in {**more, **UNLESS_IN_BUDGET}.items() if not in_budget(budget, name)]
    return ", ".join([*always, *some, *ALWAYS])
