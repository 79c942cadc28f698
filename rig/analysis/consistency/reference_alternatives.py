"""Possible faults of readings of a constant reference: the columns that checks test, and realistic fault modes.

This is the counterpart of `rig.analysis.consistency.alternatives` for accelerometers and magnetometers, whose reference
is gravity or the Earth's magnetic field.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.analysis.consistency.residual_tests import Alternatives, FaultMode
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import SECOND, Movement, cross, find_force, jacobian
from rig.estimation.reference.reading_errors import per_axis, project_errors, repeat_by_segment, select_sweeps
from rig.estimation.reference.reference_model import REFERENCE, matrix


@dataclass(frozen=True, slots=True)
class ReferenceModel:
    """The readings of a `movement` in a constant reference, and the parameters `theta` (22,) estimated from them.

    There are K = N + 3 M vector readings: one of each of N dwells, then the mean, cosine and sine of each of M sweeps.

    - `error_patterns` (P, 3 K): the effects of one standard uncertainty of each of P known, independent errors.
    - `times_s` (N + M,): the middles of the dwells' and sweeps' windows.
    - `second_order`: whether quadratic terms were estimated.
    """

    theta: Array
    movement: Movement
    error_patterns: Array
    times_s: Array
    second_order: bool

    @property
    def dwells(self) -> int:
        """The number N of dwells."""
        return len(self.movement.dwells.readings_m_s2)

    @property
    def sweeps(self) -> int:
        """The number M of sweeps."""
        return len(self.movement.sweeps.speeds_rad_s)


def alternatives(model: ReferenceModel) -> Alternatives:
    """Return the effects (3 K, k) of each possible fault, by its check's name; None stands for all residuals."""
    s, f, time = find_force(model.theta, model.movement), matrix(model.theta), _time(model)
    columns: dict[str, Array | None] = {
        "bias_changed": bias_drift_columns(model),
        "scale_changed": per_axis((s @ f.T) * time[:, None]),
        "loose_mounting": ((f @ -cross(s)) * time[:, None, None]).reshape(-1, 3),
        "even_term": jacobian(model.theta, model.movement)[:, SECOND],
        "odd_term": project_errors(model.theta, model.movement, lambda component: component**3),
        "asymmetry": project_errors(model.theta, model.movement, np.abs),
        "residuals": None,
    }
    if model.dwells and model.sweeps:
        columns["sweeps_against_dwells"] = select_sweeps(model.movement)
    return columns


def segment_columns(model: ReferenceModel, segment: int) -> Array:
    """Return columns (3 K, 3 or 9), which let all readings of one dwell or sweep differ from the model."""
    first, wide = (3 * segment, 3) if segment < model.dwells else (3 * model.dwells + 9 * (segment - model.dwells), 9)
    columns = np.zeros((model.movement.readings().size, wide))
    columns[first : first + wide] = np.eye(wide)
    return columns


def bias_drift_columns(model: ReferenceModel) -> Array:
    """Return columns (3 K, 3) of a bias that drifts at a constant rate."""
    return per_axis((_time(model) * model.movement.constant())[:, None] * np.ones(3))


def _time(model: ReferenceModel) -> Array:
    """Return the middle time (K,) of the dwell or sweep of each reading, scaled linearly to range from −1 to 1."""
    middle = repeat_by_segment(model.times_s, model.movement)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time


def _half_step(model: ReferenceModel) -> Array:
    """Return a step (K, 1) half-way through the recording: −½ for readings before it, ½ after it."""
    middle = (model.times_s.min() + model.times_s.max()) / 2
    return repeat_by_segment(np.where(model.times_s > middle, 0.5, -0.5), model.movement)[:, None]


def _dwell_columns(model: ReferenceModel) -> Array:
    """Return columns (3 K, 3 N), each of which changes the reading of one axis in one dwell by one unit."""
    count = 3 * model.dwells
    return np.eye(model.movement.readings().size)[:, :count]


def _axis_components(model: ReferenceModel) -> Array:
    """Return the components (K, 3) of the reference along the sensor's axes."""
    component: Array = find_force(model.theta, model.movement) @ matrix(model.theta).T
    return component


def _bend_pattern(change: Callable[[Array], Array]) -> Callable[[ReferenceModel], Array]:
    """Return the `patterns` of a `FaultMode` in which the error of an axis depends on the force along this axis.

    `change` takes this force and returns the error, both as multiples of the reference's norm.
    """

    def patterns(model: ReferenceModel) -> Array:
        size = float(np.linalg.norm(model.theta[REFERENCE]))
        return project_errors(model.theta, model.movement, lambda component: size * change(component / size))

    return patterns


FAULT_MODES: tuple[FaultMode[ReferenceModel], ...] = (  # (3 K, k) each
    FaultMode(
        "the bias changes half-way", "bias_changed", None,
        lambda model: per_axis(_half_step(model) * model.movement.constant()[:, None] * np.ones(3)),
    ),
    FaultMode(
        "all scale factors change half-way", "scale_changed", "1",
        lambda model: (_axis_components(model) * _half_step(model)).reshape(-1, 1),
    ),
    FaultMode(
        "one scale factor changes half-way", "scale_changed", "1",
        lambda model: per_axis(_axis_components(model) * _half_step(model)),
    ),
    FaultMode(
        "the sensor turns on the flange half-way", "loose_mounting", "rad",
        lambda model: (
            (matrix(model.theta) @ -cross(find_force(model.theta, model.movement))) * _half_step(model)[:, :, None]
        ).reshape(-1, 3),
    ),
    FaultMode("an even part, of v²/g", "even_term", "1", _bend_pattern(np.square)),
    FaultMode("an odd part, of v³/g²", "odd_term", "1", _bend_pattern(lambda component: component**3)),
    FaultMode(
        "another scale upwards than downwards", "asymmetry", "1",
        _bend_pattern(lambda component: np.abs(component) / 2),
    ),
    FaultMode(
        "another bias in sweeps than in dwells",
        "sweeps_against_dwells",
        None,
        lambda model: select_sweeps(model.movement),
    ),
    FaultMode("another reading in one dwell", "disturbed_dwell", None, _dwell_columns),
)  # fmt: skip
