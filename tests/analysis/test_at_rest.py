"""What a recording tells of its sensors at rest: within rests, never across, and not where readings are missing."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.rest_noise import QuantityNoise, log_at_rest, rest_noises
from rig.data.quantity import RATE
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.statistics.allan import AllanReading
from rig.observation.external.csv_samples import samples_in
from support.external.loggers import polled, stalled
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

NOISE_RAD_S = 0.01
SETUP = Setup(rest_s=20.0, speed_deg_s=150, noise_rad_s=NOISE_RAD_S)
RANDOM_WALK = np.hypot(NOISE_RAD_S, SENSITIVITY / np.sqrt(12)) / np.sqrt(SETUP.sample_rate_hz)


@pytest.fixture(scope="module")
def run() -> RunData:
    return synthetic_run(SETUP)


def rates(run: RunData) -> QuantityNoise:
    return rest_noises([run])["gyro"].quantities.results[RATE]


@pytest.mark.slow
def test_random_walk_is_found_in_the_rests_between_sweeps(run: RunData) -> None:
    found = rates(run)
    assert found.intervals == 6 and found.total_s == pytest.approx(6 * 19.6, abs=0.1)
    assert found.longest_s == pytest.approx(19.6, abs=0.02) and found.temperature_c == (22.0, 22.0)
    for axis in found.axes:
        assert isinstance(axis.random_walk, AllanReading)
        assert axis.random_walk.value == pytest.approx(RANDOM_WALK, abs=4 * axis.random_walk.std)
        assert isinstance(axis.bias_instability, Fault), "seconds tell nothing of it"


@pytest.mark.slow
def test_a_missing_reading_parts_a_rest_in_two(run: RunData) -> None:
    whole = rates(run)
    samples = run.samples["gyro"]
    middle = int(np.searchsorted(np.arange(len(samples)), 0.5 * len(samples)))
    inside = [index for index in (middle, middle + 238 * 10, middle + 238 * 20) if index < len(samples)]
    found = rates(replace(run, samples={"gyro": np.delete(samples, inside)}))
    assert whole.intervals < found.intervals <= whole.intervals + 3


@pytest.mark.slow
def test_a_rest_in_which_the_arm_moved_is_left_out(run: RunData) -> None:
    arm = run.states.copy()
    arm["q_rad"][(arm["time_s"] > run.states["time_s"][-1] - 15.0), 5] += 0.01
    assert rates(replace(run, states=arm)).intervals == 5


def float32(time_s: Array) -> Array:
    return np.asarray((time_s + 1e5).astype(np.float32), dtype=np.float64)


@pytest.mark.slow  # allantools takes a second to import
@pytest.mark.parametrize(
    ("rate_hz", "stamp"),
    [
        (104.0, lambda t: np.round(t, 2)),
        (119.0, lambda t: np.round(t, 3)),
        (952.0, lambda t: np.round(t, 3)),
        (952.0, float32),
        (100.0, lambda t: polled(t, 0.008)),
        (104.0, lambda t: polled(t, 0.02, late_s=0.003)),
        (200.0, lambda t: polled(t, 0.05, inner_s=1e-4)),
        (100.0, lambda t: np.maximum.accumulate(t + np.random.default_rng(1).exponential(0.005, len(t)))),
        (100.0, lambda t: stalled(t, 20.0, 0.5)),
    ],
    ids=["two decimals", "ms", "ms at 952 Hz", "float32", "polled", "BLE", "radio", "jitter", "stalled link"],
)
def test_the_curve_of_bad_stamps_is_that_of_evened_ones(rate_hz: float, stamp: Callable[[Array], Array]) -> None:
    allantools = pytest.importorskip("allantools")
    true_hz = 1.0013 * rate_hz
    time_s = np.arange(round(60 * rate_hz)) / true_hz
    readings = 0.01 * np.random.default_rng(3).normal(size=(len(time_s), 3))
    columns = {"time_s": stamp(time_s), **dict(zip(RATE.columns, readings.T, strict=True))}
    found = log_at_rest(samples_in(columns, "log")).quantities.results[RATE]
    assert found.intervals == 1
    for axis in range(3):
        _, theirs, *_ = allantools.oadev(readings[:, axis], rate=true_hz, data_type="freq", taus=found.curve.tau_s)
        assert found.curve.deviation[: len(theirs), axis] == pytest.approx(theirs, rel=0.02)
    for walk in (axis.random_walk for axis in found.axes):
        assert isinstance(walk, AllanReading)
        assert walk.value == pytest.approx(0.01 / np.sqrt(true_hz), abs=4 * walk.std)


def test_a_few_missing_readings_do_not_split_a_log_and_are_reported() -> None:
    time_s = np.arange(6000) / 104
    kept = np.random.default_rng(4).random(6000) > 0.005
    readings = 0.01 * np.random.default_rng(3).normal(size=(6000, 3))
    columns = {"time_s": np.round(time_s, 3)[kept], **dict(zip(RATE.columns, readings[kept].T, strict=True))}
    found = log_at_rest(samples_in(columns, "log"))
    assert found.quantities.results[RATE].intervals == 1
    (note,) = found.notes
    assert note.startswith(f"{np.count_nonzero(~kept)} samples are missing in ") and "after sample " in note
