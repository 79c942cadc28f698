"""Complete simulated laboratories with hidden truth: everything is drawn within the configuration's statements.

Each is a configuration for `rig run`, with the default `uncertainty`. The errors of arm, clocks and sensors lie within
it and within the data sheets of rig/config/sensors/sensor_catalogue.py.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from functools import partial
from itertools import permutations, product
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml

from rig.config.judging.judging_keys import UncertaintySection
from rig.config.load import load
from rig.config.sensors.sensor_catalogue import PARTS
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from support.laboratories.drawn_laboratory import PART_ERRORS, SQUARE_DEG, WAVE_RAD, draw_visible_vibration, leaning
from support.laboratories.worlds import merge
from support.paths import CONFIGS
from support.recordings.drawn_ripple import MOST_ORDER, drawn_ripple, make_keys

JOINTS = 6
WRISTS = np.array([0, 0, 0, 1, 1, 1])
QUIET_RAD_S, NOISY_RAD_S = 0.002, 0.035
MILLI_G_M_S2 = 1e-3 * STANDARD_GRAVITY_M_S2
STATED = UncertaintySection()
ASKEW_DEG = 8.0
WARMER_K = 0.3
BY_SHEET = tuple(name for name, part in PARTS.items() if part.delivered.acceleration_bias_mg is not None)
PART_WANDERS = {
    **PART_ERRORS,
    **dict.fromkeys(("mpu9250", *BY_SHEET), PART_ERRORS["lsm9ds1"]),
    "mavlink": {**PART_ERRORS["lsm9ds1"], "bias_per_k": 5e-5, "scale_per_k": 3e-5},
    "lines": {**PART_ERRORS["lsm9ds1"], "bias_per_k": 4.6e-3, "scale_per_k": 3.6e-4},
}
ACCELEROMETERS = {  # how far scale and bias (m/s²) may be off
    "lsm9ds1": (0.03, 0.8), "mpu9250": (0.03, 0.8), "adis16465": (0.003, 0.02), "kvh1775": (1e-3, 0.01),
    "mavlink": (0.03, 0.5),
    **{
        name: (1e-2 * (errors.acceleration_scale_percent or 1.0), MILLI_G_M_S2 * (errors.acceleration_bias_mg or 0.0))
        for name, errors in ((name, PARTS[name].delivered) for name in BY_SHEET)
    },
}  # fmt: skip
TIMEOUT_S = 3000.0
UNLIMITED = {"scale_std": 1, "bias_std_rad_s": 1, "verification_rms_rad_s": None, "verification_mean_rad_s": None}


def quiet(seed: int) -> dict[str, Any]:
    """Return a world with one LSM9DS1 with little noise."""
    return _single(seed, QUIET_RAD_S)


def noisy(seed: int) -> dict[str, Any]:
    """Return a world with one LSM9DS1 with the noise of demo.yaml."""
    return _single(seed, NOISY_RAD_S)


def _single(seed: int, noise_rad_s: float) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    document = merge(_document("demo"), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(35, 120))))
    return _add_sensors(document, rng, {"lsm9ds1": noise_rad_s})


def pair(seed: int) -> dict[str, Any]:
    """Return a world with a quiet LSM9DS1 and an ADIS16465, both calibrated."""
    rng = np.random.default_rng(seed)
    document = merge(_document("lsm9ds1_adis16465"), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(35, 120))))
    document["procedure"]["verify"] = False
    for name in ("role", "turntable"):
        document["sensors"]["reference"].pop(name)
    return _add_sensors(document, rng, {"lsm9ds1": QUIET_RAD_S, "adis16465": 0.00045})


def imu(seed: int) -> dict[str, Any]:
    """Return a world with three gyroscopes and their accelerometers."""
    rng = np.random.default_rng(seed)
    document = merge(_document("imu"), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(45, 90))))
    site = document["site"]
    expanded = site["gravity_uncertainty_m_s2"]
    document["world"]["site"]["gravity_m_s2"] = float(rng.normal(site["gravity_m_s2"], expanded / 2))
    return _add_sensors(document, rng, {"lsm9ds1": 0.0014, "mpu9250": 0.0014, "adis16465": 0.00032})


def kvh(seed: int) -> dict[str, Any]:
    """Return a world with a KVH 1775 that measures the Earth's rate and has, as stated, no g-sensitivity."""
    rng = np.random.default_rng(seed)
    document = merge(_document("own_port/kvh1775_earth"), _laboratory(seed, rng, speed_deg_s=60.0))
    document["world"]["site"]["gravity_m_s2"] = 9.80061 + float(rng.uniform(-5e-4, 5e-4))  # with the anomaly by rocks
    document["site"] = {"gravity_m_s2": 9.80061}  # it finds latitude and heading
    sensor = {
        "scale": rng.uniform(0.998, 1.002, 3).tolist(),
        "bias_rad_s": rng.uniform(-1e-5, 1e-5, 3).tolist(),
        "mounting_error_deg": _askew(rng, 0.5),
        "non_orthogonality_deg": leaning(rng, "kvh1775"),
        "offset_mm": _offset(rng),
        "bias_instability_rad_s": 2.4e-7 * float(rng.uniform(0.5, 1.5)),
        "nonlinearity_odd_per_rad_s": _odd(rng, "kvh1775", document["sensors"]["kvh"]),
        "accelerometer": _accelerometer(rng, document["sensors"]["kvh"]),
        "kvh1775": {"oscillator_ppm": float(rng.uniform(-20, 20)), "uptime_s": float(rng.uniform(1, 4000))},
    }
    changed: dict[str, Any] = merge(document, {"world": {"sensors": {"kvh": sensor}}})
    return changed


def world_by_datasheet(part: str, seed: int) -> dict[str, Any]:
    """Return a world with a part and its accelerometer, with errors up to those of its data sheet."""
    rng = np.random.default_rng(seed)
    document = merge(_document(part), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(45, 90))))
    site = document["site"]
    expanded = site["gravity_uncertainty_m_s2"]
    document["world"]["site"]["gravity_m_s2"] = float(rng.normal(site["gravity_m_s2"], expanded / 2))
    document["sensors"] = {name: sensor for name, sensor in document["sensors"].items() if sensor is not None}
    ((name, section),) = document["sensors"].items()
    sheet, delivered = PARTS[part], PARTS[part].delivered
    assert (
        delivered.bias_deg_s is not None and delivered.scale_percent is not None and delivered.rate_percent is not None
    )
    half_band_hz = section["rate_hz"] / 2
    noise_rad_s = np.radians(sheet.angle_random_walk_deg_sqrt_h / 60) * np.sqrt(2 * half_band_hz)
    noise_m_s2 = 1e-6 * sheet.acceleration_noise_ug_sqrt_hz * np.sqrt(half_band_hz) * STANDARD_GRAVITY_M_S2
    bias_rad_s, bias_per_k = np.radians([delivered.bias_deg_s, sheet.bias_deg_s_k])
    drawn = {
        **_sensor(rng, section, float(noise_rad_s)),
        "scale": rng.uniform(-1, 1, 3) * 1e-2 * delivered.scale_percent + 1,
        "bias_rad_s": rng.uniform(-1, 1, 3) * bias_rad_s,
        "bias_rad_s_per_k": rng.uniform(-1, 1, 3) * bias_per_k,
        "scale_per_k": rng.uniform(-1, 1, 3) * 1e-6 * sheet.scale_ppm_k,
    }
    drawn = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in drawn.items()}
    drawn["data_rate_ppm"] = float(rng.uniform(-1, 1) * 1e4 * delivered.rate_percent)
    drawn["accelerometer"]["noise_m_s2"] = float(noise_m_s2)
    document["world"]["sensors"] = {name: drawn}
    return _add_mountings(document, rng)


def _add_mountings(document: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    mounted: dict[str, Any] = merge(
        document, {"sensors": {name: {"mounting": _mounting(rng)} for name in document["sensors"]}}
    )
    return mounted


def autopilot(seed: int) -> dict[str, Any]:
    """Return a world with an autopilot's IMU: ArduPilot's in single precision, or PX4's in whole mrad/s, corrections
    on.
    """
    rng = np.random.default_rng(seed)
    document = merge(_document("own_port/autopilot"), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(35, 120))))
    document["world"]["time_scale"] = 8
    for name in ("autopilot", "temperature_c"):
        document["world"]["sensors"]["imu1"].pop(name)
    document["sensors"]["imu1"].pop("acceleration")
    changed = _add_sensors(document, rng, {"mavlink": 0.001})
    px4 = seed % 2 == 1
    stem = "CAL_GYRO0_{}OFF" if px4 else "INS_GYROFFS_{}"
    offsets = {stem.format(axis): float(rng.uniform(-0.05, 0.05)) for axis in "XYZ"}
    changed["world"]["sensors"]["imu1"]["autopilot"] = {
        "firmware": "px4" if px4 else "ardupilot",
        "clock_ppm": float(rng.uniform(-1, 1)) * STATED.crystal_ppm,
        "parameters": {**offsets, "SENS_BOARD_ROT" if px4 else "AHRS_ORIENTATION": int(rng.choice([0, 4, 6, 8]))},
        "doubled": 0.002,
    }
    changed["limits"] |= {"scale_deviation": 0.2, "bias_rad_s": 0.2}
    changed["sensors"]["imu1"]["mavlink"]["imu"] = "SCALED_IMU" if px4 else "HIGHRES_IMU"
    return changed


def world_of_message(message: str, noise_rad_s: float, *, vibrates: bool, seed: int) -> dict[str, Any]:
    """Return a world with an autopilot's IMU of this noise before its filter, read by this message.

    The arm vibrates only if `vibrates`. One seed of three is an autopilot that provides no temperature.
    """
    document = autopilot(2 * seed)  # ArduPilot's, which has every message
    sensor = document["world"]["sensors"]["imu1"]
    sensor["noise_rad_s"] = noise_rad_s
    sensor["autopilot"]["provides_temperature"] = seed % 3 != 0
    document["sensors"]["imu1"]["mavlink"]["imu"] = message
    return _shaking(document, vibrates=vibrates)


def world_with_digits(decimals: int, noise_rad_s: float, *, vibrates: bool, seed: int) -> dict[str, Any]:
    """Return a world with a device that prints °/s with these decimals, which the section states for odd seeds."""
    document = prints_lines(3 * seed)
    document["world"]["sensors"]["imu"]["noise_rad_s"] = noise_rad_s
    printed = document["sensors"]["imu"]["lines"]
    document["world"]["sensors"]["imu"]["lines"]["prints"] = {
        **printed,
        "rate": {"unit": "deg/s", "decimals": decimals},
    }
    printed["rate"] = {"unit": "deg/s", "decimals": decimals if seed % 2 else None}
    return _shaking(document, vibrates=vibrates)


def _shaking(document: dict[str, Any], *, vibrates: bool) -> dict[str, Any]:
    still: dict[str, Any] = dict.fromkeys(
        ("vibration_fraction", "vibration_rms_rad_s", "vibration_measured_rms_rad_s"), 0.0
    )
    still["drive"] = {"ripple": list[float]()}
    shaken: dict[str, Any] = document if vibrates else merge(document, {"world": {"arm": still}})
    return shaken


def prints_lines(seed: int) -> dict[str, Any]:
    """Return a world with a device that prints lines, by its own time, by a counter, or by both; some are lost."""
    rng = np.random.default_rng(seed)
    document = merge(_document("own_port/lines"), _laboratory(seed, rng, speed_deg_s=float(rng.uniform(35, 120))))
    document["world"]["time_scale"] = 8
    for name in ("lines", "temperature_c", "accelerometer"):
        document["world"]["sensors"]["imu"].pop(name)
    changed = _add_sensors(document, rng, {"lines": 0.001})
    lines = changed["sensors"]["imu"]["lines"]
    if seed % 3:
        lines["columns"] = ["time", "sequence", *lines["columns"][1:]]
    if seed % 3 == 2:
        lines |= {"clock": "counted", "sequence_wrap": 65536}
    changed["world"]["sensors"]["imu"]["lines"] = {
        "oscillator_ppm": float(rng.uniform(-200, 200)),
        "comment_every": 300,
    }
    changed["limits"] |= {"scale_deviation": 0.2, "bias_rad_s": 0.2}
    return changed


def world_on_arm(model: str, seed: int) -> dict[str, Any]:
    """Return the world `quiet` on another arm."""
    document: dict[str, Any] = merge(quiet(seed), {"arm": {"model": model}})
    return document


def world_with_ripple(family: Callable[[int], dict[str, Any]], seed: int) -> dict[str, Any]:
    """Return a world of a family, on an arm whose ripple and vibrations come at any order of the revolution."""
    document = family(seed)
    turn_hz = document["procedure"]["speed_deg_s"] / 360
    rates_hz = [sensor["rate_hz"] for sensor in document["sensors"].values() if sensor]
    ripple = drawn_ripple(np.random.default_rng([seed, 47]), turn_hz, rates_hz)
    changed: dict[str, Any] = merge(document, {"world": {"arm": make_keys(ripple)}})
    return changed


OTHER_ARMS = ("ur3e", "ur5e", "ur20", "ur10_cb3")
MORE_ARMS = ("ur7e", "ur12e", "ur16e", "ur30")  # of which one world each is enough: they differ from these in lengths
FAMILIES: Mapping[str, Callable[[int], dict[str, Any]]] = MappingProxyType(
    {
        "quiet": quiet,
        "noisy": noisy,
        "pair": pair,
        "imu": imu,
        "kvh": kvh,
        **{model: partial(world_on_arm, model) for model in (*OTHER_ARMS, *MORE_ARMS)},
        **{part: partial(world_by_datasheet, part) for part in BY_SHEET},
        "autopilot": autopilot,
        "lines": prints_lines,
        "rippled pair": partial(world_with_ripple, pair),
        "rippled imu": partial(world_with_ripple, imu),
    }
)
WORLDS = MappingProxyType(
    {
        "quiet": 60,
        "noisy": 40,
        "pair": 20,
        "imu": 20,
        "kvh": 10,
        **dict.fromkeys((*OTHER_ARMS, *BY_SHEET, "autopilot", "lines"), 6),
        "rippled pair": 100,
        "rippled imu": 40,
    }
)


def _document(name: str) -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load(load(Path(CONFIGS / f"{name}.yaml")).text)
    return document


def _laboratory(seed: int, rng: np.random.Generator, *, speed_deg_s: float) -> dict[str, Any]:
    """Return site, arm and board, and limits that none of these parts can exceed."""
    site = {"latitude_deg": float(rng.uniform(-65, 65)), "heading_deg": float(rng.uniform(0, 360))}
    return {
        "site": site,
        "limits": UNLIMITED,
        "history": {"off": True},
        "procedure": {"speed_deg_s": speed_deg_s},
        "world": {
            "seed": seed,
            "time_scale": 15,  # if faster, a busy machine asks the board too late for stored readings
            "site": {**site, "base_tilt_deg": rng.normal(0, 0.15, 2).tolist()},
            "arm": _arm(rng),
            "board": {
                "crystal_ppm": float(rng.uniform(-1, 1)) * STATED.crystal_ppm,
                "boot_time_s": float(rng.uniform(0.05, 2)),
            },
        },
    }


def _drive(rng: np.random.Generator) -> dict[str, Any]:
    """Draw the joints' response to targets: about that in logs of real arms, sometimes with gears of another ratio."""
    ratio = int(rng.choice([50, 80, 100, 100, 100, 101, 120, 160]))
    orders = [order for order in (ratio, 2 * ratio, 4 * ratio) if order <= MOST_ORDER]
    sizes = [(0.3e-3, 3e-3), (1e-3, 4e-3), (0.1e-3, 0.8e-3)]
    ripple = [
        {"cycles_per_turn": order, "rms_rad_s": np.exp(rng.uniform(low, high, JOINTS)).tolist()}
        for order, (low, high) in zip(orders, np.log(sizes), strict=False)
    ]
    return {
        "ripple": ripple,
        "lag_s": float(rng.uniform(2e-4, 8e-4)),
        "yield_s2": float(rng.uniform(0.5e-4, 4e-4)),
        "yield_time_s": float(rng.uniform(4e-3, 10e-3)),
        "crosstalk": float(rng.uniform(0, 0.2)),
    }


def _arm(rng: np.random.Generator) -> dict[str, Any]:
    """Draw the section `world.arm`: errors of its joints, encoders and clock."""
    vibration = draw_visible_vibration(rng)
    separate = rng.spawn(1)[0]  # later draws remain the same
    drive, has_rough_ripple = _drive(separate), bool(separate.random() < 0.3)
    rough = float(rng.uniform(0, 0.05))
    axis_rad, again_rad = np.radians([STATED.axis_deg, STATED.repeatability_deg])
    return {
        "drive": drive,
        "encoder_noise_rad": float(separate.uniform(1.5e-5, 4e-5)),
        "vibration_fraction": rough if has_rough_ripple else 0.0,
        "vibration_rms_rad_s": float(rng.uniform(0, 0.004)),
        "vibration_hz": float(rng.uniform(8, 30)),
        **vibration,
        "settling_rad": 5.0e-5,
        "settling_hz": 12,
        "settling_decay_s": 0.15,
        "clock_ppm": float(rng.uniform(-1, 1)) * STATED.controller_clock_ppm,
        "state_jitter_s": float(rng.uniform(0, 1e-4)),
        "calibration": {
            "delta_alpha_rad": (6e-4 * WRISTS * rng.standard_normal(JOINTS)).tolist(),
            "delta_theta_rad": (6e-4 * WRISTS * rng.standard_normal(JOINTS)).tolist(),
            "delta_d_mm": rng.normal(0, 0.2, JOINTS).tolist(),
        },
        "unmodelled": {
            "twist_rad": (axis_rad * WRISTS * rng.uniform(-1, 1, JOINTS)).tolist(),
            "zero_rad": (axis_rad * WRISTS * rng.uniform(-1, 1, JOINTS)).tolist(),
            "encoder_once_rad": float(rng.rayleigh(WAVE_RAD)),
            "encoder_twice_rad": float(rng.rayleigh(WAVE_RAD)),
            "hysteresis_rad": float(again_rad * rng.uniform(0, 1)),
        },
    }


def _add_sensors(document: dict[str, Any], rng: np.random.Generator, noise: Mapping[str, float]) -> dict[str, Any]:
    sensors = {name: sensor for name, sensor in document["sensors"].items() if sensor is not None}
    changes = {
        "sensors": {name: {"mounting": _mounting(rng)} for name in sensors},
        "world": {"sensors": {name: _sensor(rng, sensor, noise[sensor["part"]]) for name, sensor in sensors.items()}},
    }
    changed: dict[str, Any] = merge(document, changes)
    return changed


def _sensor(rng: np.random.Generator, section: Mapping[str, Any], noise_rad_s: float) -> dict[str, Any]:
    part = section["part"]
    errors = PART_WANDERS[part]
    of_force = {"accelerometer": _accelerometer(rng, section)} if "acceleration" in section else {}
    return {
        "scale": rng.uniform(0.9, 1.1, 3).tolist(),
        "bias_rad_s": rng.uniform(-0.02, 0.02, 3).tolist(),
        "noise_rad_s": noise_rad_s,
        "mounting_error_deg": _askew(rng, ASKEW_DEG),
        "non_orthogonality_deg": leaning(rng, part),
        "offset_mm": _offset(rng),
        "start_temperature_c": 22 - float(rng.uniform(0, WARMER_K)),
        "warm_up_s": 300,
        "bias_rad_s_per_k": rng.normal(0, errors["bias_per_k"], 3).tolist(),
        "scale_per_k": rng.normal(0, errors["scale_per_k"], 3).tolist(),
        "g_sensitivity_rad_s_per_g": _draw_force(rng, part),
        "bias_instability_rad_s": errors["flicker_rad_s"] * float(rng.uniform(0.5, 1.5)),
        "bias_random_walk_rad_s_per_sqrt_s": errors["walk"] * float(rng.uniform(0.5, 3)),
        "nonlinearity_odd_per_rad_s": _odd(rng, part, section),
        "nonlinearity_even_per_rad_s": _even(rng, part, section),
        **of_force,
    }


def _draw_force(rng: np.random.Generator, part: str) -> list[list[float]]:
    g_rad_s = np.radians(PARTS[part].g_sensitivity_deg_s_g)
    drawn: list[list[float]] = rng.uniform(-g_rad_s, g_rad_s, (3, 3)).tolist()
    return drawn


def _accelerometer(rng: np.random.Generator, section: Mapping[str, Any]) -> dict[str, Any]:
    """Draw an accelerometer whose nonlinearity and temperature terms have the half-widths of its data sheet."""
    part = section["part"]
    (scale, bias_m_s2), sheet = ACCELEROMETERS[part], PARTS[part]
    over_g = sheet.acceleration_nonlinear_over_g or section["acceleration"]["range_g"]
    bent_s2_m = 2 * sheet.acceleration_nonlinearity_percent / 100 / (over_g * STANDARD_GRAVITY_M_S2)
    bias_m_s2_k, scale_per_k = (
        1e-3 * sheet.acceleration_bias_mg_k * STANDARD_GRAVITY_M_S2,
        1e-6 * sheet.acceleration_scale_ppm_k,
    )
    flicker_m_s2 = 1e-6 * sheet.acceleration_bias_instability_ug * STANDARD_GRAVITY_M_S2
    return {
        "scale": rng.uniform(1 - scale, 1 + scale, 3).tolist(),
        "bias_m_s2": rng.uniform(-bias_m_s2, bias_m_s2, 3).tolist(),
        "non_orthogonality_deg": rng.normal(0, SQUARE_DEG.get(part, 0.3), 3).tolist(),
        "second_order_s2_m": rng.uniform(-bent_s2_m, bent_s2_m, 3).tolist(),
        "bias_m_s2_per_k": rng.uniform(-bias_m_s2_k, bias_m_s2_k, 3).tolist(),
        "scale_per_k": rng.uniform(-scale_per_k, scale_per_k, 3).tolist(),
        "bias_instability_m_s2": flicker_m_s2 * float(rng.uniform(0.5, 1.5)),
        **_lag(float(rng.uniform(0.1, 1)) * STATED.acceleration_lag_ms),
    }


def _lag(whole_ms: float) -> dict[str, float]:
    """Split a lag into half a low-pass filter and half a delay."""
    return {"bandwidth_hz": 1e3 / (np.pi * whole_ms), "delay_ms": whole_ms / 2}


def _odd(rng: np.random.Generator, part: str, section: Mapping[str, Any]) -> float:
    """Draw the odd nonlinearity per rad/s; at full scale it stays within the part's data sheet."""
    return float(rng.uniform(-1, 1) * PARTS[part].nonlinearity_percent / 100 / _full_rad_s(part, section))


def _even(rng: np.random.Generator, part: str, section: Mapping[str, Any]) -> float:
    return float(rng.uniform(-1, 1) * PARTS[part].asymmetry_percent / 100 / _full_rad_s(part, section))


def _full_rad_s(part: str, section: Mapping[str, Any]) -> float:
    return float(np.radians(section.get("range_deg_s", PARTS[part].default_range_deg_s)))


def _askew(rng: np.random.Generator, most_deg: float) -> list[float]:
    direction = rng.standard_normal(3)
    turn: list[float] = (rng.uniform(0, most_deg) * direction / np.linalg.norm(direction)).tolist()
    return turn


def _offset(rng: np.random.Generator) -> list[float]:
    offset: list[float] = rng.uniform(-STATED.sensor_offset_mm, STATED.sensor_offset_mm, 3).tolist()
    return offset


def _mounting(rng: np.random.Generator) -> dict[str, str]:
    """Draw one of the 24 right-handed mountings."""
    all_of_them = [
        {
            axis: f"{'+' if sign > 0 else '-'}{'xyz'[index]}"
            for axis, sign, index in zip("xyz", signs, order, strict=True)
        }
        for order in permutations(range(3))
        for signs in product((1, -1), repeat=3)
        if np.linalg.det(np.eye(3)[list(order)]) * np.prod(signs) > 0
    ]
    return all_of_them[int(rng.integers(len(all_of_them)))]


def first_seed(family: str) -> int:
    """Return the first seed of a family; no two families share one."""
    return 1000 * (1 + list(FAMILIES).index(family))


def record(family: str, seed: int, folder: Path) -> None:
    """Run `rig run` in `folder`, which keeps its configuration, its run folder and its output."""
    host = f"127.{100 + seed // 1000}.{seed % 1000 // 200 + 1}.{seed % 200 + 1}"
    run_in(move_to_address(FAMILIES[family](seed), host), folder)


def run_in(document: Mapping[str, Any], folder: Path) -> None:
    """Run `rig run` with a configuration in `folder`, as `recorded`."""
    folder.mkdir(parents=True)
    config = folder / "config.yaml"
    config.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(folder / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    (folder / "said").write_text(done.stdout + done.stderr, encoding="utf-8")
    (folder / "status").write_text(f"{done.returncode}\n", encoding="utf-8")


def move_to_address(document: dict[str, Any], host: str) -> dict[str, Any]:
    """Give the laboratory a loopback address of its own, by a change of `document`."""
    document["arm"]["host"] = host
    if "board" in document:
        document["board"]["port"] = f"socket://{host}:7321"
    for sensor in document["sensors"].values():
        if sensor and "serial" in sensor:
            sensor["serial"]["port"] = f"socket://{host}:7331"
        if sensor and "mavlink" in sensor:
            sensor["mavlink"]["port"] = f"socket://{host}:5760"
    return document
