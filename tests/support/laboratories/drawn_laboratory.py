"""Simulated laboratories with all possible errors, drawn from their distributions, and their truth."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import yaml

from rig.config.load import parse
from rig.config.sensors.sensor_catalogue import PARTS
from rig.world.board.windowed_truth import SimulatedTruth
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import merge
from support.paths import CONFIGS

SPEED_RAD_S = np.pi / 3
JOINTS = 6
AXIS_RAD = np.radians(0.06)  # half-width, as `uncertainty.axis_deg` has it by default
WAVE_RAD = 0.3 * AXIS_RAD / np.sqrt(3)  # of the encoders' waves, cosine and sine each
SQUARE_DEG = {"adis16465": 0.05, "kvh1775": 0.03}  # how far axes are from right angles, one standard deviation
PART_ERRORS: dict[str, dict[str, float]] = {  # standard deviations, as those values that the configurations give
    "lsm9ds1": {
        "g_rad_s": 1.7e-3, "bias_per_k": 5e-4, "scale_per_k": 3e-4, "flicker_rad_s": 4.8e-5, "walk": 1e-5,
        "odd": 2.3e-4, "even": 5e-5, "noise_rad_s": 0.002,
    },
    "adis16465": {
        "g_rad_s": 2.6e-4, "bias_per_k": 0.0, "scale_per_k": 0.0, "flicker_rad_s": 9.7e-6, "walk": 3e-7,
        "odd": 0.0, "even": 0.0, "noise_rad_s": 0.00045,
    },
}  # fmt: skip


def drawn(seed: int) -> dict[str, Any]:
    """Return a configuration to calibrate an LSM9DS1 and an ADIS16465, in a laboratory of its own."""
    rng = np.random.default_rng(seed)
    document = ideal_document(CONFIGS / "lsm9ds1_adis16465.yaml")
    for name in ("role", "turntable"):
        document["sensors"]["reference"].pop(name)
    site = {"latitude_deg": float(rng.uniform(30, 60)), "heading_deg": float(rng.uniform(0, 360))}
    changes: dict[str, Any] = {
        "site": site,
        "procedure": {"verify": False},
        "limits": {
            "scale_std": 1,
            "bias_std_rad_s": 1,
            "verification_rms_rad_s": None,
            "verification_mean_rad_s": None,
        },
        "world": {
            "seed": seed,
            "site": {
                **site,
                "base_tilt_deg": rng.normal(0, 0.15, 2).tolist(),
                "gravity_m_s2": float(rng.uniform(9.79, 9.82)),
            },
            "arm": _arm(rng),
            "board": {"crystal_ppm": float(rng.uniform(-20, 20))},
            "sensors": {name: _sensor(rng, sensor["part"]) for name, sensor in document["sensors"].items()},
        },
    }
    changed: dict[str, Any] = merge(document, changes)
    for name in ("verification_rms_rad_s", "verification_mean_rad_s"):
        changed["limits"].pop(name)
    return changed


def _arm(rng: np.random.Generator) -> dict[str, Any]:
    wrists = np.array([0, 0, 0, 1, 1, 1])
    return {
        "vibration_rms_rad_s": float(rng.uniform(0, 0.004)),
        "vibration_hz": float(rng.uniform(8, 30)),
        **draw_visible_vibration(rng),
        "settling_rad": 5.0e-5,
        "clock_ppm": float(rng.uniform(-50, 50)),
        "state_jitter_s": float(rng.uniform(0, 1e-4)),
        "calibration": {
            "delta_alpha_rad": (6e-4 * wrists * rng.standard_normal(JOINTS)).tolist(),
            "delta_theta_rad": (6e-4 * wrists * rng.standard_normal(JOINTS)).tolist(),
            "delta_d_mm": rng.normal(0, 0.2, JOINTS).tolist(),
        },
        "unmodelled": {
            "twist_rad": (AXIS_RAD * wrists * rng.uniform(-1, 1, JOINTS)).tolist(),
            "zero_rad": (AXIS_RAD * wrists * rng.uniform(-1, 1, JOINTS)).tolist(),
            "encoder_once_rad": float(rng.rayleigh(WAVE_RAD)),
            "encoder_twice_rad": float(rng.rayleigh(WAVE_RAD)),
            "hysteresis_rad": 5.0e-5,
        },
    }


def draw_visible_vibration(rng: np.random.Generator) -> dict[str, float]:
    """Draw a vibration that the encoders see, in addition to one that they do not; later draws remain the same."""
    separate_sensor_errors = rng.spawn(1)[0]
    return {
        "vibration_measured_rms_rad_s": float(separate_sensor_errors.uniform(0, 0.002)),
        "vibration_measured_hz": float(separate_sensor_errors.uniform(8, 30)),
    }


def _sensor(rng: np.random.Generator, part: str) -> dict[str, Any]:
    errors = PART_ERRORS[part]
    return {
        "scale": rng.uniform(0.9, 1.1, 3).tolist(),
        "bias_rad_s": rng.uniform(-0.02, 0.02, 3).tolist(),
        "noise_rad_s": errors["noise_rad_s"],
        "mounting_error_deg": rng.normal(0, 2, 3).tolist(),
        "non_orthogonality_deg": leaning(rng, part),
        "offset_mm": rng.uniform(-20, 20, 3).tolist(),
        "start_temperature_c": 22 - float(rng.uniform(0, 0.3)),
        "bias_rad_s_per_k": rng.normal(0, errors["bias_per_k"], 3).tolist(),
        "scale_per_k": rng.normal(0, errors["scale_per_k"], 3).tolist(),
        "g_sensitivity_rad_s_per_g": rng.normal(0, errors["g_rad_s"], (3, 3)).tolist(),
        "bias_instability_rad_s": errors["flicker_rad_s"] * float(rng.uniform(0.5, 1.5)),
        "bias_random_walk_rad_s_per_sqrt_s": errors["walk"] * float(rng.uniform(0.5, 3)),
        "nonlinearity_odd_per_rad_s": float(rng.normal(0, errors["odd"])),
        "nonlinearity_even_per_rad_s": float(rng.normal(0, errors["even"])),
    }


def leaning(rng: np.random.Generator, part: str) -> list[float]:
    """Draw non-orthogonality angles within the data sheet."""
    most_deg = PARTS[part].non_orthogonality_deg
    leaning: list[float] = np.clip(rng.normal(0, SQUARE_DEG.get(part, 0.2), 3), -most_deg, most_deg).tolist()
    return leaning


def truth(
    document: Mapping[str, Any], name: str, windows_s: Iterable[tuple[float, float]], speed_rad_s: float = SPEED_RAD_S
) -> np.ndarray:
    """Return (6,) a sensor's scale at plus and minus a speed and bias without gravity, as means over world times."""
    simulated, windows = _simulated(document), [*windows_s]
    return np.concatenate([simulated.scale(name, windows, speed_rad_s), simulated.bias_rad_s(name, windows)])


def bias_at_0_g(document: Mapping[str, Any], name: str, windows_s: Iterable[tuple[float, float]]) -> np.ndarray:
    """Return the mean reading (3,) of a sensor's accelerometer without noise and specific force."""
    return _simulated(document).bias_m_s2(name, [*windows_s])


def _simulated(document: Mapping[str, Any]) -> SimulatedTruth:
    loaded = parse(yaml.safe_dump(dict(document)))
    return SimulatedTruth(loaded.config, read_world_section(loaded))
