"""The truth of the simulated sensors over the windows of a run, for comparison with its result.

The world writes it into a file of its own. No estimator reads that file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, accelerations
from firmware_host.emulator.parts.gyroscope import readings
from rig.config.models import RigConfig
from rig.config.world.laboratory import WorldSection
from rig.world.board.sensor_truth import SensorTruth

SCHEMA = "rig.truth/1"
STEP_S = 0.05  # interval of the instants of a mean; longer in long windows
MAX_INSTANTS = 20_000
SPEED_TOLERANCE = 0.01  # relative difference, below which two speeds count as one

Windows = Sequence[tuple[float, float]]


class SimulatedTruth:
    """The truth of all simulated sensors, without noise; each value is a mean over windows (n, 2) of time, s.

    Each value is that of one sensor axis while rotation or gravity acts along this axis alone, so that oblique axes and
    mounting have no influence.
    """

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        self._config, self._world = config, world

    def scale(self, name: str, windows_s: Windows, speed_rad_s: float) -> np.ndarray:
        """Return the scale factors (3,) of a gyroscope, from rotation about each axis at ± `speed_rad_s`."""
        difference = self._rates(name, windows_s, speed_rad_s) - self._rates(name, windows_s, -speed_rad_s)
        mean: np.ndarray = np.mean(2 * speed_rad_s / difference, axis=0)
        return mean

    def bias_rad_s(self, name: str, windows_s: Windows) -> np.ndarray:
        """Return the bias (3,) of a gyroscope that does not rotate, without the effect of gravity."""
        return -np.asarray(self._rates(name, windows_s, 0.0).mean(axis=0))

    def acceleration_scale(self, name: str, windows_s: Windows) -> np.ndarray:
        """Return the scale factors (3,) of an accelerometer, from plus and minus 1 g along each axis."""
        up, down = (self._accelerations(name, windows_s, sign * STANDARD_GRAVITY_M_S2) for sign in (1, -1))
        mean: np.ndarray = np.mean(2 * STANDARD_GRAVITY_M_S2 / (up - down), axis=0)
        return mean

    def bias_m_s2(self, name: str, windows_s: Windows) -> np.ndarray:
        """Return the bias (3,) of an accelerometer: its reading without a specific force."""
        mean: np.ndarray = self._accelerations(name, windows_s, 0.0).mean(axis=0)
        return mean

    def depends_on_speed(self, name: str) -> bool:
        """Return whether the scale factors between two opposite rotations depend on the rotations' speed."""
        return self._world.sensors[name].nonlinearity_odd_per_rad_s != 0

    def _rates(self, name: str, windows_s: Windows, rate_rad_s: float) -> np.ndarray:
        """Return the readings (n, 3) of the gyroscope without noise or axis errors, at one rate about every axis."""
        sensor, time_s = self._sensor(name), _instants(windows_s)
        quiet = replace(
            sensor.gyro,
            noise_rad_s=0.0,
            g_sensitivity_rad_s_per_g=(),
            non_orthogonality_rad=(0.0, 0.0, 0.0),
            bandwidth_hz=None,
            delay_s=0.0,
        )
        return readings(quiet, time_s, np.full((len(time_s), 3), rate_rad_s), self._seed(name), sensor.temperature_c)

    def _accelerations(self, name: str, windows_s: Windows, force_m_s2: float) -> np.ndarray:
        """Return readings (n, 3) of the accelerometer without noise or axis errors, at equal forces along all axes."""
        sensor, time_s = self._sensor(name), _instants(windows_s)
        if sensor.accelerometer is None:
            raise ValueError(f"nothing reads the accelerometer of {name}")
        quiet = replace(
            sensor.accelerometer, noise_m_s2=0.0, non_orthogonality_rad=(0.0, 0.0, 0.0), bandwidth_hz=None, delay_s=0.0
        )
        force = np.full((len(time_s), 3), force_m_s2)
        return accelerations(quiet, time_s, force, self._seed(name), sensor.temperature_c)

    def _sensor(self, name: str) -> SensorTruth:
        return SensorTruth(self._config.sensors[name], self._world.sensors[name])

    def _seed(self, name: str) -> np.random.SeedSequence:
        """Return the seed of a sensor's drift. The laboratory's simulation of the sensor has the same seed."""
        return np.random.SeedSequence([self._world.seed, sorted(self._world.sensors).index(name)])


def truth_document(truth: SimulatedTruth, windows: Mapping[str, Any], now_s: float) -> dict[str, Any]:
    """Return the truth over the windows of a run, by the keys of its result.

    `windows` has two mappings by sensor name. `gyroscopes` gives the windows of the sweeps (`sweeps_s`) and of all
    averages (`averages_s`), and the speeds (`speeds_rad_s`). `accelerometers` gives the windows of all readings
    (`readings_s`). An empty list of windows stands for the whole time until `now_s`. A bias is a mean from the first to
    the last window, as in the result. A scale factor that depends on the speed is left out unless all speeds are equal.
    """
    whole = [(0.0, now_s)]
    document: dict[str, Any] = {"schema": SCHEMA, "simulated": True, "gyroscopes": {}, "accelerometers": {}}
    for name, gyroscope in windows.get("gyroscopes", {}).items():
        entry = {"bias_rad_s": truth.bias_rad_s(name, _span(gyroscope["averages_s"] or whole)).tolist()}
        speeds = gyroscope["speeds_rad_s"]
        if not truth.depends_on_speed(name) or (speeds and max(speeds) <= (1 + SPEED_TOLERANCE) * min(speeds)):
            speed_rad_s = float(np.mean(speeds)) if speeds else 1.0
            entry["scale"] = truth.scale(name, gyroscope["sweeps_s"] or whole, speed_rad_s).tolist()
        document["gyroscopes"][name] = entry
    for name, accelerometer in windows.get("accelerometers", {}).items():
        readings_s = accelerometer["readings_s"] or whole
        document["accelerometers"][name] = {
            "scale": truth.acceleration_scale(name, readings_s).tolist(),
            "bias_m_s2": truth.bias_m_s2(name, _span(readings_s)).tolist(),
        }
    return document


def _span(windows_s: Windows) -> Windows:
    return [(min(start_s for start_s, _ in windows_s), max(end_s for _, end_s in windows_s))]


def _instants(windows_s: Windows) -> np.ndarray:
    """Return the instants (n,), in order of time, whose values are averaged to a mean over the windows."""
    step_s = max(STEP_S, sum(end_s - start_s for start_s, end_s in windows_s) / MAX_INSTANTS)
    return np.concatenate([np.arange(start_s, end_s, step_s) for start_s, end_s in sorted(windows_s)])
