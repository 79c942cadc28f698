"""How far two tests of the field at home may differ: by noise, and by an arm that comes back to a little elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.estimation.reference.magnetometer import FieldDrift
from rig.observation.field_means import field_tests
from rig.plans.recorded_run import RecordedRun, judge_phases, open_run
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow


def drift_of(run: RecordedRun) -> FieldDrift:
    drift = judge_phases(run).magnetometers.results["compass"].drift
    assert drift is not None
    return drift


@pytest.mark.thorough
def test_what_is_stated_of_the_arms_returns_is_a_half_width_and_no_standard_deviation() -> None:
    recorded = open_run(RECORDINGS / "magnetometer")
    (run,) = recorded.movement
    first = field_tests(observe_recordings([run])[0], "compass", run.settings.observation, run.settings.home_q_rad)[0]
    known = run.settings.stated_uncertainty
    half_width_t = np.radians(known.repeatability_deg) * np.linalg.norm(first.mean)
    exact = replace(run.settings, uncertainty=known.model_copy(update={"repeatability_deg": 0.0}))
    returning = replace(recorded, raw=(replace(run, settings=exact),))
    more_t2 = drift_of(recorded).std_t ** 2 - drift_of(returning).std_t ** 2
    assert more_t2 == pytest.approx(2 * half_width_t**2 / 3, rel=1e-6, abs=0)
