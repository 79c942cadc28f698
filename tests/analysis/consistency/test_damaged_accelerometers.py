"""No damage of an accelerometer passes that puts it off by more than its uncertainty, whatever the part."""

import numpy as np
import pytest

from rig.errors import Fault
from support.recordings.drawn_accelerations import (
    Damage,
    Session,
    bent,
    disturb,
    drawn,
    find_detected,
    scale_half,
    solve_session,
    step_bias,
    swept,
)

pytestmark = pytest.mark.slow

PARTS = ("lsm9ds1", "mpu9250", "adis16465", "kvh1775")
RATE = 1e-3 / 14  # of false alarms for each check: docs/method.md
SMALLEST, LARGEST, STEP = 1e-6, 1.0, 1.2
# What is planted, and how many U it may pass by: one and a half, the sizes are in docs/uncertainty.md.
DAMAGES: dict[str, tuple[Damage, float]] = {
    "even": (bent(np.square), 1.5),
    "odd": (bent(lambda along: along**3, scale=1.0), 1.5),
    "asymmetry": (bent(np.abs), 1.5),
    "sweeps only": (swept, 1.5),
    "bias step": (step_bias, 1.5),
    "scale step": (scale_half(np.ones(3)), 1.5),
    "scale step of one axis": (scale_half(np.array([1.0, 0.0, 0.0])), 1.5),
    "one dwell": (disturb, 1.5),
}


def passes(session: Session) -> float | None:
    """By how many U the parameter farthest off is, or None where something is told."""
    try:
        solution, budget, off = solve_session(session)
    except Fault:
        return None
    return None if find_detected(session, solution, RATE) else float(np.max(np.abs(off) / budget.expanded))


def just_below(damage: Damage, session: Session) -> tuple[float, float]:
    """The largest size that is not told, to a step, and by how many U it passes."""
    low, high = SMALLEST, LARGEST
    while high / low > STEP:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if passes(damage(session, middle)) is None else (middle, high)
    by = passes(damage(session, low))
    assert by is not None, "nothing is told of an undamaged sensor"
    return low, by


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("name", DAMAGES)
def test_what_is_just_not_told_is_within_the_uncertainty(part: str, name: str) -> None:
    """Half of the sessions: noise alone puts the worst of six parameters off by 0.8 U, and in one of twenty by 1.3."""
    damage, most = DAMAGES[name]
    found = [just_below(damage, drawn(part, seed)) for seed in range(8)]
    sizes, passed = np.median(found, axis=0)
    print(f"{part}, {name}: told from {sizes:.2g} on, below it {passed:.2f} U off")
    assert passed <= most


@pytest.mark.one_in(11)
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("even", 0.05),
        ("odd", 0.05),
        ("asymmetry", 0.01),
        ("sweeps only", 0.02),
        ("bias step", 0.02),
        ("one dwell", 0.1),
    ],
)
def test_a_large_error_is_reported(part: str, name: str, size: float) -> None:
    assert passes(DAMAGES[name][0](drawn(part, 1), size)) is None


@pytest.mark.thorough
@pytest.mark.parametrize("part", PARTS)
def test_a_sensor_as_its_data_sheet_lets_it_be_is_told_nothing_of_and_within_its_uncertainty(part: str) -> None:
    by = passes(drawn(part, 2))
    assert by is not None and by < 1.5
