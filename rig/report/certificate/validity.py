"""What a certificate's uncertainties leave out, quantity by quantity: nobody should take it for included."""

from collections.abc import Sequence

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import BudgetEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import SensorEntry

NONLINEARITY, TEMPERATURE, POWER, MOUNTING = "nonlinearity", "temperature", "switching", "mounting"
# What each is called in words. A budget with a line of that name has it in, and it is not left out.
ALWAYS = {
    TEMPERATURE: "other temperatures",
    POWER: "switching off and on",
    MOUNTING: "mounting anew and its stress",
    "vibration": "vibration that the item rectifies",
    "ageing": "ageing and transport",
}


def left_out_of_rates(sensor: SensorEntry) -> str:
    """Of a gyroscope's U."""
    straight = {} if sensor.nonlinearity is not None else {NONLINEARITY: "nonlinearity at other speeds"}
    return _left_out(sensor.budget, straight)


def left_out_of_accelerations(found: AccelerometerEntry) -> str:
    """Of an accelerometer's U."""
    bent = "nonlinearity" if found.second_order_s2_m is None else "nonlinearity beyond the second order"
    return _left_out(found.budget, {NONLINEARITY: bent})


def left_out_of_fields(found: MagnetometerEntry) -> str:
    """Of a magnetometer's U; what it reads of the arm is told beside its bias."""
    return _left_out(found.budget, {NONLINEARITY: "nonlinearity", "magnetised": "iron magnetised since"})


def _left_out(budget: BudgetEntry | None, more: dict[str, str]) -> str:
    counted: Sequence[str] = () if budget is None else [line.name for line in budget.contributors]
    said = [words for name, words in {**more, **ALWAYS}.items() if not any(name in line for line in counted)]
    return ", ".join(said)
