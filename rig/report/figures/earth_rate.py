"""A gyroscope that has found the Earth's rate, drawn as in TRIAX, Figs. 2 and 3: how it was turned, what is left."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.earth_rate import EarthRate
from rig.estimation.gyroscope.vector_fit import Explained
from rig.motion.geometry import flange_attitude
from rig.observation.observed_run import ObservedRun
from rig.report.figures.verification import Picture, envelope, write_pictures
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATE_HZ = 25.0  # at which TRIAX samples
GAP_S = 1.0


def write_earth_rate_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """`earth_rate_<sensor>` of every sensor that has found it, as PNG and SVG; none without matplotlib."""
    found = {
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
                partial(_draw, recording=outcome.recordings[0], sensor=sensor, explained=explained, earth=earth),
            )
            for sensor, (explained, earth) in found.items()
        ],
        folder,
    )


def _draw(figure: "Figure", recording: ObservedRun, sensor: str, explained: Explained, earth: EarthRate) -> None:
    draw_errors(figure, *errors(recording, sensor, explained, earth))


def errors(recording: ObservedRun, sensor: str, explained: Explained, earth: EarthRate) -> tuple[Array, Array, Array]:
    """Times (n,), rates of the flange (n, 3), and calibrated readings less these and the Earth's rate (n, 3), rad/s.

    Means over 1 / `RATE_HZ`, in the flange's frame, where the arm's states follow each other closely.
    """
    stream, motion, solution = recording.stream(sensor), recording.motion, explained.solution
    many = max(1, round(stream.sensor.rate_hz / RATE_HZ))
    count = len(stream.time_s) // many * many
    time_s = stream.time_s[:count].reshape(-1, many).mean(axis=1)
    known = motion.covered(time_s)
    turned, readings = (
        values[:count].reshape(-1, many, 3).mean(axis=1)[known]
        for values in (motion.rate(stream.time_s), stream.readings_rad_s)
    )
    felt = flange_attitude(motion.angles(time_s[known]), motion.kinematics) @ earth.rate_rad_s @ motion.mount.T
    found = (readings + solution.bias_rad_s) @ np.linalg.inv(solution.matrix).T
    return time_s[known] - time_s[known][0], turned, found - turned - felt


def draw_errors(figure: "Figure", time_s: Array, turned: Array, error: Array) -> None:
    """Draw the turned rate left as in Fig. 2, the error right as in Fig. 3, °/s."""
    left, right = figure.subplots(1, 2)
    for i, axis in enumerate("xyz"):
        left.plot(*_curve(time_s, np.degrees(turned[:, i])), lw=0.7, color=f"C{i}", label=axis)
        std = np.degrees(error[:, i].std())
        right.plot(
            *_curve(time_s, np.degrees(error[:, i])), lw=0.5, alpha=0.8, color=f"C{i}", label=f"{axis}, σ {std:.4f}"
        )
    left.set(xlabel="time s", ylabel="°/s", title="rate of the flange in its own frame")
    right.set(xlabel="time s", ylabel="°/s", title="corrected reading − rate of flange and Earth")
    for panel in (left, right):
        panel.legend(frameon=False, ncols=3, fontsize=8)


def _curve(time_s: Array, values: Array) -> tuple[Array, Array]:
    """A curve's points, without a line across what the arm's states do not cover."""
    times, values = envelope(time_s, values)
    gaps = np.flatnonzero(np.diff(times) > GAP_S) + 1
    return np.insert(times, gaps, np.nan), np.insert(values, gaps, np.nan)
