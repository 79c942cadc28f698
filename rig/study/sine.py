"""Fig. 3 of the paper SIX: readings of a gyroscope in oscillation, before and after calibration."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.gyroscope.six_observation_batch import newton_batch
from rig.study import simulation as sim
from rig.study.study_report import Columns, Settings, StudyFinding, StudyReport

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AMPLITUDE_RAD_S, FREQUENCY_HZ, DURATION_S = 1.0, 0.75, 4.0
NOISE_RAD_S = 0.035
SCALE = np.array([0.9070, 1.0501, 0.8734])  # SIX, section III-A
BIAS_RAD_S = np.array([0.0528, 0.0813, -0.0992])
PUBLISHED_ESTIMATE = (0.9070, 1.0502, 0.8735, 0.0529, 0.0802, -0.0994)


def study(settings: Settings) -> StudyReport:
    """Simulate a calibration at 3 rad/s, then a sine of 1 rad/s and 0.75 Hz about an axis equally far from x, y and z.

    The paper corrects "using Eq. (1)", printed as g = K m + b. With the paper's own estimates that equation would leave
    errors of (1 − k) b, so the correction here is g = K (m + b).
    """
    rng = np.random.default_rng(settings.seed)
    sweep = sim.build_whole_turn(sim.FAST_SPEED_RAD_S, NOISE_RAD_S)
    means = sim.draw_mean_readings(rng, np.diag(1 / SCALE), BIAS_RAD_S, sweep)
    solved = newton_batch(means[None], sim.FAST_SPEED_RAD_S)
    scale, bias = solved.scale[0], solved.bias_rad_s[0]
    time_s = np.arange(round(DURATION_S * sim.RATE_HZ)) / sim.RATE_HZ
    desired = AMPLITUDE_RAD_S * np.sin(2 * np.pi * FREQUENCY_HZ * time_s)
    actual = desired + sim.VIBRATION_FRACTION * np.abs(desired) * rng.normal(size=len(desired))
    rate = np.repeat(actual[:, None] / np.sqrt(3), 3, axis=1)
    reading = rate / SCALE - BIAS_RAD_S + NOISE_RAD_S * rng.normal(size=rate.shape)
    corrected = scale * (reading + bias)
    columns: Columns = {
        "time_s": time_s,
        "desired_rad_s": desired,
        **{f"true_{axis}_rad_s": rate[:, i] for i, axis in enumerate("xyz")},
        **{f"reading_{axis}_rad_s": reading[:, i] for i, axis in enumerate("xyz")},
        **{f"calibrated_{axis}_rad_s": corrected[:, i] for i, axis in enumerate("xyz")},
    }
    findings = [
        StudyFinding(f"estimate of {name}", float(value), "1" if name[0] == "k" else "rad/s", published)
        for name, value, published in zip(PARAMETERS, [*scale, *bias], PUBLISHED_ESTIMATE, strict=True)
    ]
    for i, axis in enumerate("xyz"):
        for when, readings in (("before", reading), ("after", corrected)):
            mean, rms = np.mean(readings[:, i] - rate[:, i]), np.sqrt(np.mean((readings[:, i] - rate[:, i]) ** 2))
            findings.append(StudyFinding(f"mean error of {axis} {when} calibration", float(mean), "rad/s"))
            findings.append(StudyFinding(f"RMS error of {axis} {when} calibration", float(rms), "rad/s"))
    return StudyReport(columns, tuple(findings), partial(_draw, time_s, desired, reading, corrected), (12.0, 6.0))


def _draw(time_s: Array, desired: Array, reading: Array, corrected: Array, figure: "Figure") -> None:
    panels = figure.subplots(2, 2, sharex=True, sharey=True).flat
    next_panel = iter(panels)
    overview = next(next_panel)
    overview.plot(time_s, desired, "k")
    overview.set(title="desired rate about the axis of rotation", ylabel="rad/s")
    for i, panel in enumerate(next_panel):
        panel.plot(time_s, reading[:, i], color="tab:orange", linewidth=0.8, label="before calibration")
        panel.plot(time_s, corrected[:, i], color="tab:blue", linewidth=0.8, label="after calibration")
        panel.plot(time_s, desired / np.sqrt(3), "k--", label="desired")
        panel.set(title=f"axis {'xyz'[i]}", xlabel="time, s", ylabel="rad/s")
        panel.legend(loc="lower right")
    figure.suptitle("SIX Fig. 3: a swing of 1 rad/s at 0.75 Hz, noise 0.035 rad/s, vibration 5 %")
