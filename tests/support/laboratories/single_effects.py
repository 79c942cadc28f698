"""Simulated laboratories with a single error, and the best possible uncertainty of a calibration there."""

from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from rig.config.sensors.sensor_catalogue import PARTS
from rig.estimation.statistics.bias_process import flicker_covariance, walk_covariance
from rig.observation.observed_run import ObservedRun
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import merge
from support.paths import CONFIGS

NOISE_RAD_S = 0.002
FLICKER_RAD_S = float(np.radians(PARTS["lsm9ds1"].bias_instability_deg_h) / 3600)  # stated of its kind
WALK_RAD_S_SQRT_S = 3e-5


class Effect(Enum):
    """The only error of a laboratory."""

    WALK = "bias random walk"
    NONLINEARITY = "nonlinearity"
    GRAVITY = "g-sensitivity"
    TWISTS = "twists"
    CLOCK = "controller clock"


def world_with_effect(effect: Effect, seed: int) -> dict[str, Any]:
    """Return a configuration: an LSM9DS1 with its usual flicker noise, mounted 5° askew, without other errors."""
    rng = np.random.default_rng(seed)
    document = ideal_document(CONFIGS / "demo.yaml")
    sensor: dict[str, Any] = {
        "scale": rng.uniform(0.9, 1.1, 3).tolist(),
        "bias_rad_s": rng.uniform(-0.02, 0.02, 3).tolist(),
        "noise_rad_s": NOISE_RAD_S,
        "bias_instability_rad_s": FLICKER_RAD_S,
        "mounting_error_deg": (5 * _direction(rng)).tolist(),
    }
    clock_ppm = {"controller_clock_ppm": 1e-3, "crystal_ppm": 1e-3}
    arm: dict[str, Any] = {}
    procedure: dict[str, Any] = {}
    match effect:
        case Effect.WALK:
            sensor["bias_random_walk_rad_s_per_sqrt_s"] = WALK_RAD_S_SQRT_S
        case Effect.NONLINEARITY:
            sensor["nonlinearity_odd_per_rad_s"] = 5e-4
            procedure["speeds_deg_s"] = [30, 60, 90]
        case Effect.GRAVITY:
            sensor["g_sensitivity_rad_s_per_g"] = rng.normal(0, np.radians(0.1), (3, 3)).tolist()
        case Effect.TWISTS:
            arm["calibration"] = {"delta_alpha_rad": [0, 0, 0, -8e-4, 4e-4, 0]}
        case Effect.CLOCK:
            arm["clock_ppm"] = 40
            clock_ppm = dict[str, float]()
    changes = {
        "procedure": procedure,
        "uncertainty": {**clock_ppm, "axis_deg": 0, "sensor_offset_mm": 0},
        "limits": {"scale_std": 1, "bias_std_rad_s": 1},
        "world": {
            "seed": seed,
            "arm": arm,
            "board": {"crystal_ppm": float(rng.uniform(-20, 20)) if effect is Effect.CLOCK else 0.0},
            "sensors": {"gyro": sensor},
        },
    }
    changed: dict[str, Any] = merge(document, changes)
    if procedure:
        changed["procedure"].pop("speed_deg_s")
    return changed


def bound(effect: Effect, run: ObservedRun, document: Mapping[str, Any]) -> np.ndarray:
    """Return the standard deviations (6,) of scale and bias by an estimator that knows the sizes of effect and flicker.

    It is generalised least squares for each axis, of a row of the matrix, the bias and gravity's effect, with the
    effect's own columns or covariance.
    """
    recorded = run.sensors["gyro"]
    averages = [*(turn.average for turn in recorded.revolutions), *recorded.rests]
    turned = [turn.speed_rad_s * turn.axis_flange for turn in recorded.revolutions]
    rates = np.array([*turned, *np.zeros((len(recorded.rests), 3))])
    upwards = np.array([average.attitude for average in averages]) @ (0.0, 0.0, 1.0)
    windows_s = [(average.start_s, average.end_s) for average in averages]
    flicker = FLICKER_RAD_S**2 * flicker_covariance(windows_s)
    walk = WALK_RAD_S_SQRT_S**2 * walk_covariance(windows_s)
    noise = np.array([average.noise_rad_s**2 / average.samples for average in averages])
    means = np.array([average.mean_rad_s for average in averages])
    stds = np.empty((2, 3))
    for axis, scale in enumerate(document["world"]["sensors"]["gyro"]["scale"]):
        design = np.column_stack([rates, np.ones(len(rates)), upwards])
        row, *_ = np.linalg.lstsq(design, means[:, axis], rcond=None)
        sensed_axis = row[:3] / np.linalg.norm(row[:3])
        if effect is Effect.NONLINEARITY:
            sensed = rates @ sensed_axis
            design = np.column_stack([design, np.abs(sensed) * sensed, sensed**2])
        spread = np.diag(noise[:, axis]) + flicker + (walk if effect is Effect.WALK else 0.0)
        covariance = np.linalg.inv(design.T @ np.linalg.solve(spread, design))
        stds[:, axis] = scale**2 * np.sqrt(sensed_axis @ covariance[:3, :3] @ sensed_axis), np.sqrt(covariance[3, 3])
        if effect is Effect.CLOCK:
            clock = 1e-6 / np.sqrt(3 / 50**2 + 3 / 20**2)
            stds[0, axis] = np.hypot(stds[0, axis], scale * clock)
    return stds.ravel()


def _direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))
