"""A sample that was lost on the way from one sweep to the next moves no check: such a way is left out."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.data.recording.run_file import read_run
from rig.observation.windows import swept
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow


def test_a_sample_lost_where_the_arm_moves_between_two_sweeps_fails_no_check() -> None:
    run = read_run(RECORDINGS / "lines" / "run.h5")
    samples = run.samples["imu"]
    whole = calibrate([run], DEFAULT_ESTIMATOR)
    time_base = whole.recordings[0].sensors["imu"].time_base
    time_s = time_base.controller_time_s(1e-6 * samples["board_time_us"].astype(np.float64))
    windows = sorted((sweep.window.start_s, sweep.window.end_s) for sweep in swept(run))
    between = np.zeros(len(samples), np.bool_)
    for (_, end_s), (start_s, _) in pairwise(windows):
        between |= (time_s > end_s) & (time_s < start_s)
    fastest = int(np.argmax(np.where(between, np.abs(samples["counts"]).max(axis=1), 0)))
    lossy = replace(run, samples={"imu": np.delete(samples, fastest)})
    outcome = calibrate([lossy], DEFAULT_ESTIMATOR)
    assert not [check for check in (*whole.checks, *outcome.checks) if not check.passed]
