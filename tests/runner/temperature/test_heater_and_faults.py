"""No fault of the table leaves the heater on: a few of them here, each once in `make proof`."""

import time
from pathlib import Path
from random import Random
from typing import Any

import pytest

from support.fault_matrix.bench import END_S, POLL_S, QUICK, REAL, START_S, Bench, bench
from support.fault_matrix.catalogue import BY_NAME
from support.fault_matrix.clock_shift import shift_clock
from support.fault_matrix.setups import SWEEPS
from support.laboratories.worlds import merge

OFF_WITHIN_S = 2.5  # of the laboratory's clock, after the run has ended
WATCHED_S = 3.0
HEATED: dict[str, Any] = merge(
    SWEEPS,
    {
        "procedure": {
            "name": "thermal",
            "order": None,
            "directions": None,
            "from_c": 25,
            "to_c": 45,
            "max_step_k": 5,
            "max_rate_k_per_min": 60,
            "reference_c": 30,
            "heater_power": 1,
            "both_directions": False,
            "repeats": 2,  # the run ends soon, if the fault does not end it
        },
        "world": {"thermal": {"start_c": 23, "capacity_j_k": 3, "loss_w_k": 0.1, "heater_w": 5}},
    },
)
FEW = ["board: wire stalls", "sensor: silent: no data-ready"]
PROOF = [pytest.mark.proof, pytest.mark.thorough]

pytestmark = pytest.mark.slow


def heats(here: Bench) -> bool:
    return bool(here.world.control({"do": "heater"})["duty"] > 0)


def off_after_s(here: Bench) -> float:
    """How long the heater stays on from now, by the laboratory's clock."""
    began_s = now_s = here.world.control({"do": "heater"})["time_s"]
    while heats(here):
        now_s = here.world.control({"do": "heater"})["time_s"]
        assert now_s - began_s < 10 * OFF_WITHIN_S, "the heater is still on"
        time.sleep(POLL_S)
    return float(now_s - began_s)


@pytest.mark.thorough
@pytest.mark.parametrize("name", [*FEW, *(pytest.param(name, marks=PROOF) for name in BY_NAME if name not in FEW)])
def test_no_fault_leaves_the_heater_on(name: str, tmp_path: Path) -> None:
    fault, folder = BY_NAME[name], tmp_path / "cell"
    environment = shift_clock(tmp_path) if "CLOCK_SHIFT" in fault.environment else {}
    with bench(folder, HEATED, environment) as here:
        here.start()
        assert here.until(lambda _state: heats(here), START_S), here.read_output("run")[-500:]
        here.pace(REAL)
        fault.bring(here, Random(5))
        if fault.lasts_s is not None:
            time.sleep(fault.lasts_s)
            fault.mend(here, Random(5))
        began_s = time.monotonic()
        while here.running and time.monotonic() - began_s < WATCHED_S:
            time.sleep(POLL_S)
        here.pace(QUICK)
        assert here.ended(END_S), "it hangs"
        here.pace(REAL)
        assert off_after_s(here) <= OFF_WITHIN_S
        for second in here.companions:
            second.communicate(timeout=END_S)
