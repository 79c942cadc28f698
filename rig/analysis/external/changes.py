"""The refusal of a recording in which a sensor changes abruptly, by more than U covers."""

import numpy as np

from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.external.abrupt_change import CERTAIN_EVIDENCE, AbruptChange

MAX_SCALE_CHANGE = 0.01  # of a part, over tens of kelvins
REMEDY = "Solve the parts before and after separately; look for a knock, or a range that was switched"


def check_steady(change: AbruptChange | None, quantity: Quantity, least_evidence: float = CERTAIN_EVIDENCE) -> None:
    """Raise Fault `bias_jumped` or `scale_changed` if a change has enough evidence and is larger than U covers."""
    if change is None or change.evidence < least_evidence:
        return
    axis = int(np.argmax(np.abs(change.sizes)))
    size, name = float(change.sizes[axis]), quantity.axes[axis]
    if change.what == "bias" and abs(size) > quantity.steady:
        raise Fault(
            "bias_jumped",
            f"from {change.from_s:.6g} s on the {quantity.sensor} reads {abs(size):.2g} {quantity.unit} "
            f"{'more' if size > 0 else 'less'} on {name} than before: its bias has changed",
            f"{REMEDY}; let it warm up",
        )
    if change.what == "scale" and abs(size) > MAX_SCALE_CHANGE:
        raise Fault(
            "scale_changed",
            f"from {change.from_s:.6g} s on the {quantity.sensor} reads {100 * abs(size):.2g} % "
            f"{'more' if size > 0 else 'less'} on {name} of the same motion than before",
            f"{REMEDY}; check that the source of the motion did not change either",
        )
