"""Recordings of two gyroscopes on one board, computed: the one under test, raw or calibrated, and its reference."""

from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.gyroscope.alignment import LinearCalibration
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from support.recordings.recorded import change_channel
from support.recordings.synthetic_run import (
    BIAS_RAD_S,
    SCALE,
    SENSITIVITY,
    Motion,
    Setup,
    readings,
    run_data,
    sample_times,
    sizes_of,
    true_rate,
)

REFERENCE = Setup(
    scale=(1.002, 0.998, 1.001),
    bias_rad_s=(0.0021, -0.0015, 0.0008),
    noise_rad_s=0.001,
    mounting_error_rad=(0.01, 0.02, -0.015),
    sample_rate_hz=200.0,
)


@dataclass(frozen=True, slots=True)
class Stored:
    """The calibration that the board applies in calibrated mode; by default the truth."""

    scale: Array
    bias_rad_s: Array

    @property
    def correction_matrix(self) -> Array:
        """The matrix K (3, 3)."""
        return np.diag(self.scale)


TRUTH = Stored(np.array(SCALE), np.array(BIAS_RAD_S))


def recording(
    setup: Setup,
    *,
    stored: LinearCalibration | None = None,
    reference: Setup = REFERENCE,
    lag_s: float = 0.0,
    axes: Array | None = None,
) -> RunData:
    """Compute a recording of `gyro` and `reference`; the board corrects the gyro by `stored`, None leaves it raw.

    The gyro's filter lags the reference's by `lag_s`; `axes` (3, 3) replace the flange's axes for the gyro.
    """
    skew = {"gyro": np.eye(3) if axes is None else axes, "reference": np.eye(3)}
    rng = np.random.default_rng(setup.seed)
    motion = Motion(setup, rng)
    runs = {}
    for name, part in (("gyro", setup), ("reference", replace(reference, boot_s=setup.boot_s))):
        board_s, controller_s = sample_times(part, motion)
        rates = true_rate(motion, controller_s - (lag_s if name == "gyro" else 0.0))
        runs[name] = run_data(setup, motion, board_s, readings(part, rates @ skew[name].T, rng))
    run = runs["gyro"]
    sensors = {**run.sensors, "reference": replace(run.sensors["gyro"], part="adis16465", rate_hz=200.0)}
    samples = {**run.samples, "reference": runs["reference"].samples["gyro"]}
    if stored is not None:
        raw = samples["gyro"]["counts"] * SENSITIVITY
        samples["gyro"]["counts"] = np.round(1e6 * (raw + stored.bias_rad_s) @ stored.correction_matrix.T)
        corrected = change_channel(sensors["gyro"], unit_per_count=1e-6, full_scale_counts=2**31 - 1)
        sensors["gyro"] = replace(corrected, mode="calibrated")
    uncertainty = run.settings.stated_uncertainty
    sizes = sizes_of({name: sensor.part for name, sensor in sensors.items()})
    settings = replace(run.settings, uncertainty=uncertainty.model_copy(update=sizes))
    return replace(run, sensors=sensors, samples=samples, settings=settings)
