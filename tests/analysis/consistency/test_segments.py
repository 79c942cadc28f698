"""Segments of sweeps in which the arm vibrates, whole and where states are lost."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.consistency.state_errors import build_reading_patterns
from rig.analysis.environment import SPLINE_NOISE_RATIO, find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.analysis.gyroscope.segment_table import Segments, stack_segments
from rig.data.recording.run_data import RunData
from rig.observation.consistency.segments import segment_recordings
from rig.observation.windows import swept
from support.recordings.synthetic_run import BIAS_RAD_S, SCALE, SENSITIVITY, Setup, synthetic_run

pytestmark = pytest.mark.slow

SHAKEN = Setup(
    noise_rad_s=4.5e-4,
    vibration=0.0,
    mounting_error_rad=(0.0, 0.0, 0.0),
    state_rate_hz=500.0,
    sample_rate_hz=200.0,
    encoder_noise_rad=0.0,  # which adds as much as the sensor's own noise in a second
)
NOISE_RAD = 2.4e-5  # of an encoder
UNSEEN_RAD_S, HERTZ = 0.004, 8.58


def unseen(run: RunData, hertz: float = HERTZ, rms_rad_s: float | tuple[float, float, float] = UNSEEN_RAD_S) -> RunData:
    """With a vibration about each axis of which no state tells."""
    samples = run.samples["gyro"].copy()
    phase = 2 * np.pi * hertz * 1e-6 * samples["board_time_us"][:, None] + [0.3, 2.0, 4.1]
    samples["counts"] += np.round(np.sqrt(2) * np.array(rms_rad_s) * np.sin(phase) / SENSITIVITY).astype(np.int32)
    return replace(run, samples={"gyro": samples})


def without_states(run: RunData, from_s: float, to_s: float) -> RunData:
    """Of each sweep, between so many seconds after it began."""
    kept = np.ones(len(run.states), dtype=np.bool_)
    for sweep in swept(run):
        since_s = run.states["time_s"] - sweep.window.start_s
        kept &= (since_s < from_s) | (since_s > to_s)
    return replace(run, states=run.states[kept])


def segments_of(run: RunData) -> Segments:
    recordings = observe_recordings([run])
    result = solve_observed(run.sensors, recordings, environment=find_environment(recordings, run.settings))["gyro"]
    assert result.explained is not None and run.settings.site is not None
    return stack_segments(segment_recordings("gyro", recordings), result.explained, run.settings.site)


@pytest.mark.parametrize(("lost_s", "known_rad_s"), [(0.0, 4e-5), (0.3, 8e-5)])
def test_of_a_vibration_that_no_encoder_sees_a_segment_keeps_no_more_than_is_stated(
    lost_s: float, known_rad_s: float
) -> None:
    """Without states for a while the readings left are no longer even, and what is found of a line in them less."""
    run = unseen(synthetic_run(SHAKEN))
    segments = segments_of(without_states(run, 3.0, 3.0 + lost_s) if lost_s else run)
    turning = segments.sweep >= 0
    off = (segments.means_rad_s + BIAS_RAD_S - segments.rates_rad_s / SCALE)[turning]
    variances = segments.variances_rad2_s2[turning]
    assert np.sqrt(np.mean(variances)) < known_rad_s
    assert 0.75 < np.sqrt(np.mean(off**2 / variances)) < 1.25


@pytest.mark.one_in(2)  # the other direction: `make proof`
@pytest.mark.parametrize("axes", [(1.0, 0.0, 0.0), (1.0, 1.0, 1.0)])
def test_a_vibration_slower_than_a_segment_is_in_its_uncertainty(axes: tuple[float, float, float]) -> None:
    """Weights that cancel it would amplify the encoders' noise: sound sweeps would contradict each other."""
    run = unseen(synthetic_run(replace(SHAKEN, noise_rad_s=5e-5)))
    for hertz in (0.81, 1.29):
        run = unseen(run, hertz, (5e-4 * axes[0], 5e-4 * axes[1], 5e-4 * axes[2]))
    segments = segments_of(run)
    turning = segments.sweep >= 0
    off = (segments.means_rad_s + BIAS_RAD_S - segments.rates_rad_s / SCALE)[turning]
    relative = np.sqrt(np.mean(off**2 / segments.variances_rad2_s2[turning], axis=0))
    assert ((relative > 0.45) & (relative < 1.25)).all()
    (recorded,) = observe_recordings([run])
    amplification = [
        segment.mean.weights @ segment.mean.weights * segment.mean.samples
        for turn in segment_recordings("gyro", [recorded])
        for segment in turn.segments
    ]
    assert max(amplification) < 1.5, "nothing is amplified"


def swinging(run: RunData) -> RunData:
    """With all joints swinging by more than an encoder's noise."""
    states = run.states.copy()
    states["q_rad"] += 4e-4 * np.sin(2 * np.pi * 0.4 * states["time_s"])[:, None]
    return replace(run, states=states)


@pytest.mark.one_in(2)  # states at the other rate: `make proof`
@pytest.mark.parametrize("state_rate_hz", [125.0, 500.0])
def test_what_the_encoders_noise_makes_of_rates_across_the_swept_axis_is_stated(state_rate_hz: float) -> None:
    """Errors of neighbouring segments have the edge between them in common: over a whole sweep they cancel."""
    noisy = replace(SHAKEN, encoder_noise_rad=NOISE_RAD, state_rate_hz=state_rate_hz)
    segments, exact = (
        segments_of(swinging(synthetic_run(setup))) for setup in (noisy, replace(noisy, encoder_noise_rad=0.0))
    )
    patterns = build_reading_patterns(segments, SPLINE_NOISE_RATIO * NOISE_RAD)
    turning = segments.sweep >= 0
    off = (segments.rates_rad_s - exact.rates_rad_s)[turning]
    across = np.abs(segments.rates_rad_s[turning]) < 0.1
    variances = (patterns[:, turning] ** 2).sum(axis=0)
    assert 0.85 < np.sqrt(np.mean(off[across] ** 2) / np.mean(variances[across])) < 1.15
    sums = np.array([patterns[:, segments.sweep == sweep].sum(axis=1) for sweep in np.unique(segments.sweep[turning])])
    assert np.mean((sums**2).sum(axis=1)) / np.mean((patterns[:, turning] ** 2).sum(axis=0)) == pytest.approx(
        1, abs=0.2
    )


def test_the_encoders_noise_of_joints_that_stand_still_adds_no_rate_across_the_swept_axis() -> None:
    noisy = replace(SHAKEN, encoder_noise_rad=NOISE_RAD)
    (recorded,) = observe_recordings([synthetic_run(noisy)])
    rates = np.array([turn.axis_flange * turn.speed_rad_s for turn in recorded.sensors["gyro"].revolutions])
    assert np.abs(rates[np.abs(rates) < 0.1]).max() < NOISE_RAD / 5, "by the angles at both ends 6e-6 rad/s in 6 s"
    segments = segments_of(synthetic_run(noisy))
    assert build_reading_patterns(segments, NOISE_RAD).size == 0
