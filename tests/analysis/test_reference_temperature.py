"""A recording of an arm whose sensor warms and cools: solved at the reference temperature, and over it."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.outcome import Outcome
from rig.analysis.temperature.over_temperature import correct_recordings
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import settings_from_json
from rig.observation.observed_run import observe_runs
from rig.observation.windows import Window
from rig.plans.recorded_run import open_run
from rig.report.document import document_of
from support.paths import RECORDINGS
from support.recordings.synthetic_run import (
    BIAS_RAD_S,
    SENSITIVITY,
    Motion,
    Setup,
    readings,
    run_data,
    sample_times,
    true_rate,
)

pytestmark = pytest.mark.slow

REFERENCE_C = 25.0
SETUP = Setup(repeats=4, noise_rad_s=0.002, mounting_error_rad=(0.0, 0.0, 0.0))
SLOPE, SHARE = np.array([4e-4, -3e-4, 1e-4]), np.array([2e-4, -1e-4, 3e-4])  # rad/s/K, of a reading; 1/K of k


@pytest.fixture(scope="module")
def warmed() -> RunData:
    """From 20 to 50 °C and back, by a thermometer in steps of 1/16 °C."""
    rng = np.random.default_rng(11)
    motion = Motion(SETUP, rng)
    board_s, time_s = sample_times(SETUP, motion)
    done = (time_s - time_s[0]) / np.ptp(time_s)
    warm = 20 + 30 * (1 - np.abs(1 - 2 * done)) - REFERENCE_C
    plain = SENSITIVITY * readings(SETUP, true_rate(motion, time_s), rng) + BIAS_RAD_S
    moved = plain / (1 + np.outer(warm, SHARE)) - BIAS_RAD_S + np.outer(warm, SLOPE)
    run = run_data(SETUP, motion, board_s, np.round(moved / SENSITIVITY))
    run.samples["gyro"]["temperature_counts"] = np.round(16 * warm)
    return replace(run, settings=replace(run.settings, reference_c=REFERENCE_C))


@pytest.fixture(scope="module")
def outcome(warmed: RunData) -> Outcome:
    return calibrate([warmed])


def test_the_calibration_is_that_of_the_reference_temperature(outcome: Outcome) -> None:
    result, budget = outcome.results["gyro"], outcome.results["gyro"].uncertainty
    assert budget is not None
    off = np.r_[result.scale - SETUP.scale, result.bias_rad_s - SETUP.bias_rad_s]

    assert result.temperature_c == REFERENCE_C
    assert (np.abs(off) < 1.5 * budget.expanded).all()
    failed = {check.name for check in outcome.checks if not check.passed}
    assert failed == {"gyro.board_scale", "gyro.board_bias"}  # no board has solved these


def test_the_polynomials_are_those_of_the_sensor(outcome: Outcome) -> None:
    found = outcome.polynomials["gyro"][RATE]
    stds = np.sqrt(np.diag(found.covariance))

    assert (np.abs(found.bias[1] - SLOPE) < 4 * stds[15:18]).all()
    assert (np.abs(found.scale[1] - SHARE * SETUP.scale) < 4 * stds[3:6]).all()
    assert found.hysteresis is not None and found.orders == (1, 1)
    assert np.allclose(
        found.evaluate(REFERENCE_C).values, np.r_[outcome.results["gyro"].scale, -outcome.results["gyro"].bias_rad_s]
    )


def test_u_at_the_reference_is_that_of_the_budget(outcome: Outcome) -> None:
    budget = outcome.results["gyro"].uncertainty
    assert budget is not None
    entry = document_of(outcome).over_temperature["gyro"]["rate"]

    assert np.allclose(outcome.polynomials["gyro"][RATE].evaluate(REFERENCE_C).std, budget.std, rtol=1e-6)
    assert {line.name for line in entry.contributors} > {"noise", "controller clock", "temperature gradient"}


def test_the_settings_keep_the_reference(warmed: RunData) -> None:
    assert settings_from_json(warmed.settings.to_json()).reference_c == REFERENCE_C


def test_an_accelerometer_in_dwells_is_taken_there_as_well() -> None:
    """A real recording's dwells, gone through at six temperatures."""
    runs = open_run(RECORDINGS / "bias_drift").movement
    (recording, *_), settings = observe_runs(runs), replace(runs[0].settings, reference_c=REFERENCE_C)
    (name,) = settings.to_calibrate
    first = {planned.index for planned in settings.planned_dwells if planned.repeat == 0}
    once = [dwell for dwell in recording.sensors[name].dwells if dwell.index in first]
    means = np.array([dwell.reading.mean for dwell in once])
    forces = -np.array([dwell.attitude for dwell in once]) @ settings.site.down_m_s2
    zero = np.linalg.lstsq(np.column_stack([forces, np.ones(len(once))]), means)[0][3]
    again = []
    for number, warm in enumerate((20.0, 31.0, 42.0, 50.0, 37.0, 26.0)):
        for place, dwell in enumerate(once):
            temperature_c = warm + 0.02 * place
            away = temperature_c - REFERENCE_C
            mean = (means[place] - zero) / (1 + SHARE * away) + zero + 20 * SLOPE * away
            window = Window(dwell.window.start_s + 900.0 * number, dwell.window.end_s + 900.0 * number)
            reading = replace(dwell.reading, mean=mean)
            again.append(replace(dwell, reading=reading, window=window, temperature_c=temperature_c))
    parts = {**recording.sensors, name: replace(recording.sensors[name], dwells=tuple(again), revolutions=(), rests=())}
    warmed = replace(recording, sensors=parts)

    taken = correct_recordings([warmed], replace(settings, planned_sweeps=()), REFERENCE_C)

    found = taken.polynomials[name][ACCELERATION]
    moved = np.array([dwell.reading.mean for dwell in taken.recordings[0].sensors[name].dwells])
    assert np.allclose(found.bias[1], 20 * SLOPE, rtol=0.05) and np.allclose(
        found.scale[1] / found.scale[0], SHARE, rtol=0.05
    )
    assert np.abs(moved - np.tile(means, (6, 1))).max() < 2e-3
    assert {dwell.temperature_c for dwell in taken.recordings[0].sensors[name].dwells} == {REFERENCE_C}
