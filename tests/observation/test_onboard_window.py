"""When a revolution was on the board's clock, as the host tells the board between two sweeps."""

import numpy as np
import pytest

from rig.data.recording.run_data import RunData
from rig.observation.onboard_window import revolution_on_the_board
from rig.observation.windows import swept
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow


def told(run: RunData, setup: Setup, sweep: int) -> tuple[float, float]:
    """The error, s, of the revolution's middle on the board's clock, and its speed in °/s.

    The host holds what came since the beginning of the sweep before the last, or since sampling began.
    """
    sweeps = list(swept(run))
    start_s, end_s = sweeps[sweep].window.start_s, sweeps[sweep].window.end_s
    since_s = sweeps[sweep - 2].window.start_s if sweep >= 2 else 0.0
    assert run.turner is not None
    samples, arm = run.samples["gyro"], run.states
    at_s = samples["board_time_us"] * 1e-6 * (1 + setup.drift) + setup.boot_s
    held = (at_s > since_s) & (at_s < end_s + 0.05)
    arm = arm[(arm["time_s"] > since_s) & (arm["time_s"] < end_s + 0.05)]
    first = int(np.searchsorted(arm["time_s"], start_s))
    start_us, end_us, speed_rad_s = revolution_on_the_board(
        samples[held],
        run.sensors["gyro"],
        arm,
        sweeps[sweep].sweep,
        first=first,
        settings=run.settings.observation,
        kinematics=run.turner.geometry,
    )
    middle_s = (start_us + end_us) / 2e6 * (1 + setup.drift) + setup.boot_s
    return middle_s - (start_s + end_s) / 2, float(np.degrees(speed_rad_s))


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "setup",
    [Setup(), Setup(speed_deg_s=10.0, rest_s=0.5), Setup(sample_rate_hz=14.9, noise_rad_s=0.005)],
    ids=["usual", "slow sweeps in noise", "few samples"],
)
def test_the_board_is_told_when_the_revolution_was(setup: Setup) -> None:
    run = synthetic_run(setup)
    for sweep in range(6):
        off_s, speed_deg_s = told(run, setup, sweep)
        assert abs(off_s) * setup.speed_deg_s < 0.4  # vibration puts the turn's middle off the sweep's
        assert speed_deg_s == pytest.approx(setup.speed_deg_s, rel=1e-4)
