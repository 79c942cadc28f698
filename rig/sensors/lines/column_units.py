"""The units of the columns of an unknown log, by their headings and by the size of their readings."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.units import UNITS
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

SI_UNITS = {"g": "rad/s", "a": "m/s2", "m": "T"}
UNSTATED = "?"  # where a number is still to be stated
MAX_SCALE_ERROR = 0.3  # of a gyroscope whose readings confirm a unit
BY_SIZE = "by size alone"
MIN_COUNT = 500.0  # larger whole numbers are steps of a converter
GRAVITY_BY_UNIT = {"m/s2": STANDARD_GRAVITY_M_S2, "g": 1.0, "mg": 1000.0}
ROUND_STEPS = (131.0, 65.5, 32.8, 16.4)  # steps per °/s, as data sheets state them
GRAVITY_TOLERANCE = 0.15  # of an uncalibrated accelerometer
MAX_RATE_RAD_S, MAX_SCATTER_RAD_S = 40.0, 0.02  # of a gyroscope; the scatter is that at rest


def choose_unit(kind: str, unit: dict[str, Any], values: Array, still: NDArray[np.bool_]) -> tuple[dict[str, Any], str]:
    """Return unit and factor of a triad in the form of a column map, and the reason if unit or factor is uncertain."""
    if (scale := unit.pop("scale", None)) is not None:
        steps = 1 / float(scale)
        near = min(ROUND_STEPS, key=lambda round_steps: abs(steps / round_steps - 1))
        exact = near if kind == "g" and abs(steps / near - 1) < 1e-3 else round(steps)
        is_whole = kind == "a" or exact == near
        return {"unit": unit["unit"], **({"lsb_per_unit": exact} if is_whole else {"factor": scale})}, ""
    if unit["unit"] != "?":
        return {"unit": unit["unit"]}, ""
    if kind == "g":
        return _choose_rate_unit(values, still)
    if kind == "a":
        level = _measure_rest(values, still)
        nearest = min(GRAVITY_BY_UNIT, key=lambda name: abs(np.log(max(level, 1e-12) / GRAVITY_BY_UNIT[name])))
        if abs(level / GRAVITY_BY_UNIT[nearest] - 1) < GRAVITY_TOLERANCE:
            return {"unit": nearest}, f"at rest it reads {level:.4g}, nearest to 1 g in {nearest}"
    return {"unit": SI_UNITS[kind]}, "the size of its readings fits no unit; check that it is SI"


def _choose_rate_unit(values: Array, still: NDArray[np.bool_]) -> tuple[dict[str, Any], str]:
    """Return the unit of a gyroscope's readings by their size, and the reason why the unit is uncertain."""
    if (values == np.rint(values)).all() and np.abs(values).max() > MIN_COUNT:
        return {"unit": "deg/s", "lsb_per_unit": UNSTATED}, "steps of a converter: state lsb_per_unit by its data sheet"
    turned = values - np.median(values[still], axis=0)
    noise = np.median(np.abs(np.diff(values, axis=0)), axis=0).max()  # a steady turn is as quiet as a rest
    if np.abs(turned).max() > MAX_RATE_RAD_S or noise > MAX_SCATTER_RAD_S:
        largest = f"{np.abs(values).max():.4g}"
        reason = f"deg/s {BY_SIZE} (up to {largest}); if these are counts, give factor or lsb_per_unit"
        return {"unit": "deg/s"}, reason
    return {"unit": "rad/s"}, f"rad/s {BY_SIZE} (up to {np.abs(values).max():.3g})"


def compare_stated(kind: str, stated: str, values: Array, still: NDArray[np.bool_]) -> tuple[dict[str, Any], str]:
    """Return the `stated` unit, or the right one and a sentence if an accelerometer's norm at rest contradicts it."""
    level = _measure_rest(values, still)
    fitting = [unit for unit, size in GRAVITY_BY_UNIT.items() if abs(level / size - 1) < GRAVITY_TOLERANCE]
    if kind == "a" and fitting and UNITS[stated] not in map(UNITS.get, fitting):  # m/s² is m/s2
        return {"unit": fitting[0]}, f"the heading says {stated}, but at rest it reads {level:.4g}, as in {fitting[0]}"
    return {"unit": stated}, ""


def _measure_rest(values: Array, still: NDArray[np.bool_]) -> float:
    """Return the median norm of readings (n, 3) in the rows at rest (`still`), or in all rows if no row is at rest."""
    return float(np.median(np.linalg.norm(values[still] if still.any() else values, axis=1)))
