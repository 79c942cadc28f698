"""While the arm stands for long, few of its states are recorded; on the way, and in short dwells, all of them."""

from pathlib import Path

import pytest

from rig.data.recording.run_file import RunRecorder, read_run
from rig.motion.turner_state import ArmState
from rig.runner.acquisition import FULL_RATE_S, REST_INTERVAL_S, Acquisition
from support.recordings.synthetic_run import PROVENANCE, SENSOR, UR, Setup, synthetic_run

pytestmark = pytest.mark.slow

STEP_S = 0.008


def states(acquisition: Acquisition, from_s: float, to_s: float) -> None:
    for number in range(round((to_s - from_s) / STEP_S)):
        q = (0.0,) * 6
        acquisition.on_state(ArmState(from_s + number * STEP_S, 1.0, q, q, 1.0, 1.0, 7, 1, 2, 3, 1))


def test_a_long_dwell_is_recorded_with_few_states_after_a_while(tmp_path: Path) -> None:
    run = synthetic_run(Setup(rest_s=0.5, speed_deg_s=150))
    path, acquisition = tmp_path / "run.h5", Acquisition()
    with RunRecorder(
        path, config=run.config, settings=run.settings, provenance=PROVENANCE, turner=UR, sensors={"gyro": SENSOR}
    ) as acquisition.recorder:
        states(acquisition, 0.0, 2.0)
        with acquisition.thin_states():
            states(acquisition, 2.0, 62.0)
        states(acquisition, 62.0, 64.0)
    time_s = read_run(path).states["time_s"]
    whole = (time_s < 2 + FULL_RATE_S) | (time_s >= 62)
    assert whole.sum() == round((2 + FULL_RATE_S + 2) / STEP_S)
    assert 0.9 * (60 - FULL_RATE_S) / REST_INTERVAL_S < (~whole).sum() <= 1.05 * (60 - FULL_RATE_S) / REST_INTERVAL_S
