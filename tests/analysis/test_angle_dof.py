"""Degrees of freedom of angles beside scale and bias come from lines of the budget, none of which may be missed."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.effective_dof import acceleration_angle_dof, angle_dof
from rig.estimation.gyroscope.budget import BIAS_DRIFT, NOISE, Budget
from rig.estimation.reference.reference_budget import ATTITUDES
from rig.plans.recorded_run import judge_phases, open_run
from support.paths import RECORDINGS


@pytest.mark.slow
def test_a_line_that_angles_have_their_freedom_of_is_there_or_told_to_be_missing() -> None:
    outcome = judge_phases(open_run(RECORDINGS / "imu"))
    (gyroscope, *_), (accelerometer, *_) = outcome.results.values(), outcome.accelerometers.values()
    assert gyroscope.uncertainty is not None and accelerometer.budget is not None
    for found in (angle_dof(gyroscope), acceleration_angle_dof(accelerometer)):
        assert found is not None and np.isfinite(found).all()
    with pytest.raises(KeyError, match=NOISE):
        angle_dof(replace(gyroscope, uncertainty=gyroscope.uncertainty.omit([NOISE])))
    with pytest.raises(KeyError, match=ATTITUDES):
        acceleration_angle_dof(replace(accelerometer, budget=accelerometer.budget.omit([ATTITUDES])))


def test_a_budget_tells_that_it_has_no_such_line() -> None:
    with pytest.raises(KeyError, match=BIAS_DRIFT):
        Budget(()).std_of(BIAS_DRIFT)
