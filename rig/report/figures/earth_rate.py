"""The Earth's rate as a gyroscope measured it, drawn as in the paper TRIAX, Figs. 2 and 3: motion and residuals."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.earth_rate import EarthRate
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.motion.geometry import flange_attitude
from rig.observation.observed_run import ObservedRun
from rig.report.figures.verification import Picture, envelope, write_pictures
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATE_HZ = 25.0  # the sample rate of TRIAX
GAP_S = 1.0


def write_earth_rate_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Draw `earth_rate_<sensor>` for each sensor that measured it; return the event that names them."""
    solved = {
        name: (result.explained, earth)
        for name, result in outcome.results.items()
        if result.explained is not None and (earth := result.earth) is not None
    }
    return write_pictures(
        [
            Picture(
                f"earth_rate_{sensor}",
                f"{sensor}: rate of the flange, and error of the calibrated gyroscope, at {RATE_HZ:g} Hz",
                (11.0, 4.6),
                partial(_draw, recording=outcome.recordings[0], sensor=sensor, fit=fit, earth=earth),
            )
            for sensor, (fit, earth) in solved.items()
        ],
        folder,
    )


def _draw(figure: "Figure", recording: ObservedRun, sensor: str, fit: VectorFit, earth: EarthRate) -> None:
    draw_errors(figure, *errors(recording, sensor, fit, earth))


def errors(recording: ObservedRun, sensor: str, fit: VectorFit, earth: EarthRate) -> tuple[Array, Array, Array]:
    """Return times (n,), the flange's rates (n, 3), and corrected readings minus the rates of flange and Earth (n, 3).

    Rates are in rad/s, averaged over 1 / `RATE_HZ`, in the flange's frame, at times with states of the arm.
    """
    stream, motion, solution = recording.stream(sensor), recording.motion, fit.solution
    samples = max(1, round(stream.sensor.rate_hz / RATE_HZ))
    count = len(stream.time_s) // samples * samples
    time_s = stream.time_s[:count].reshape(-1, samples).mean(axis=1)
    covered = motion.covered(time_s)
    flange_rate, readings = (
        values[:count].reshape(-1, samples, 3).mean(axis=1)[covered]
        for values in (motion.rate(stream.time_s), stream.readings_rad_s)
    )
    earth_rate = flange_attitude(motion.angles(time_s[covered]), motion.kinematics) @ earth.rate_rad_s @ motion.mount.T
    corrected = (readings + solution.bias_rad_s) @ np.linalg.inv(solution.matrix).T
    return time_s[covered] - time_s[covered][0], flange_rate, corrected - flange_rate - earth_rate


def draw_errors(figure: "Figure", time_s: Array, flange_rate: Array, error: Array) -> None:
    """Draw the rate of the flange on the left as in Fig. 2, the error on the right as in Fig. 3, °/s."""
    rates, residuals = figure.subplots(1, 2)
    for i, axis in enumerate("xyz"):
        rates.plot(*_curve(time_s, np.degrees(flange_rate[:, i])), lw=0.7, color=f"C{i}", label=axis)
        std = np.degrees(error[:, i].std())
        residuals.plot(
            *_curve(time_s, np.degrees(error[:, i])), lw=0.5, alpha=0.8, color=f"C{i}", label=f"{axis}, σ {std:.4f}"
        )
    rates.set(xlabel="time s", ylabel="°/s", title="rate of the flange in its own frame")
    residuals.set(xlabel="time s", ylabel="°/s", title="corrected reading − rate of flange and Earth")
    for panel in (rates, residuals):
        panel.legend(frameon=False, ncols=3, fontsize=8)


def _curve(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return times and values of a curve, interrupted by NaN at gaps of the arm's states."""
    times, values = envelope(time_s, values)
    gaps = np.flatnonzero(np.diff(times) > GAP_S) + 1
    return np.insert(times, gaps, np.nan), np.insert(values, gaps, np.nan)
