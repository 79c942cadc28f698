"""How far two tests of the field at home may differ: by noise, and by an arm that comes back to a little elsewhere."""

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.estimation.reference.magnetometer import FieldDrift
from rig.observation.field import field_tests
from rig.plans.recorded import RecordedRun, judged, open_run
from support.paths import RECORDINGS


def drift_of(run: RecordedRun) -> FieldDrift:
    drift = judged(run).magnetometers.results["compass"].drift
    assert drift is not None
    return drift


@pytest.mark.slow
def test_what_is_stated_of_the_arms_returns_is_a_half_width_and_no_standard_deviation() -> None:
    recorded = open_run(RECORDINGS / "magnetometer")
    now = recorded.judged_by(["reckoning=3"])
    run = now.movement[0]
    settings = run.settings
    first = field_tests(observe_recordings([run])[0], "compass", settings.observation, settings.home_q_rad)[0]
    assert settings.uncertainty is not None
    half_width_t = np.radians(settings.uncertainty.repeatability_deg) * np.linalg.norm(first.mean)
    less_t2 = drift_of(recorded).std_t ** 2 - drift_of(now).std_t ** 2
    assert less_t2 == pytest.approx(2 * half_width_t**2 * (1 - 1 / 3), rel=1e-6, abs=0)
