"""Faults at a moment of a whole run: a few of them here, each once in `make proof`.

benchmarks/laboratory/faults.py has each at many moments of both procedures.

A named end and its exit status, the arm at rest within a second, no sample lost, a file that opens, a run that resumes
to a pass, and a pass that is the truth.
"""

from itertools import cycle
from pathlib import Path

import pytest

from support.fault_matrix.catalogue import BY_NAME
from support.fault_matrix.cell import carry_out
from support.fault_matrix.setups import SETUPS

SPAN_S = {"six_observation": 29.0, "imu": 50.0}  # of the arm's motions, by the controller's clock
FEW = ["board: wire half-closed"]
PROOF = [pytest.mark.proof, pytest.mark.thorough]

pytestmark = pytest.mark.slow


@pytest.mark.thorough
@pytest.mark.parametrize("name", FEW)
def test_a_fault_in_a_sweep(name: str, tmp_path: Path) -> None:
    cell = carry_out(
        name, BY_NAME[name], "six_observation", tmp_path / "cell", moment=0.3, span_s=SPAN_S["six_observation"], seed=1
    )
    assert cell.met and not cell.deviations, cell


@pytest.mark.parametrize(
    ("name", "setup"), [pytest.param(*each, marks=PROOF) for each in zip(BY_NAME, cycle(SETUPS), strict=False)]
)
def test_every_fault_in_the_middle_of_a_procedure(name: str, setup: str, tmp_path: Path) -> None:
    """The procedures take turns: both for each fault would be half of all the proof."""
    cell = carry_out(name, BY_NAME[name], setup, tmp_path / "cell", moment=0.5, span_s=SPAN_S[setup], seed=2)
    assert cell.met and not cell.deviations, cell
