"""Sensors whose source sends readings in steps: messages of autopilots, lines with few digits; drawn, with a truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from rig.analysis.consistency.contradictions import contradictions
from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.quantity import RATE
from rig.data.recording.channel import Channel, thermometer_channel, triad_channel
from rig.estimation.arrays import Array
from rig.sensors.scales import fine_axes
from support.recordings.drawn_recording import Drawn, Kind, drawn
from support.recordings.synthetic_run import SENSOR

DEG = float(np.radians(1.0))
MILLI = 1e-3
FULL_RAD_S = {"mavlink": 2000 * DEG, "lines": 500 * DEG}
OF_16_BITS_RAD_S = 500 * DEG / 2**15  # a step of a MEMS gyroscope's converter


@dataclass(frozen=True, slots=True)
class Source:
    """A source of rates: `sent` converts rates in rad/s to the recorded values of `channel` of such a part."""

    part: str
    channel: Channel
    sent: Callable[[Array], Array]


def _cut(rates: Array) -> Array:
    whole = np.trunc(rates / MILLI)
    sent: Array = MILLI * (whole + 0.5 * np.sign(whole))
    return sent


def _single(rates: Array) -> Array:
    return np.asarray(np.float32(rates), dtype=np.float64)


def _make_printer(digit: float, of_a_converter: float = 0.0) -> Callable[[Array], Array]:
    """Return a function that rounds rates, rad/s, to a converter's steps, if any, then to the last digit `digit`."""

    def sent(rates: Array) -> Array:
        read = np.rint(rates / of_a_converter) * of_a_converter if of_a_converter else rates
        rounded: Array = np.rint(read / digit) * digit
        return rounded

    return sent


def _lines(digit: float, *, stated: bool = True, of_a_converter: float = 0.0) -> Source:
    full = FULL_RAD_S["lines"]
    channel = triad_channel(RATE, digit, int(full / digit), full) if stated else fine_axes(RATE, full)
    return Source("lines", channel, _make_printer(digit, of_a_converter))


_FINE = fine_axes(RATE, FULL_RAD_S["mavlink"])
SOURCES: Mapping[str, Source] = MappingProxyType(
    {
        "SCALED_IMU": Source("mavlink", replace(_FINE, step=2 * MILLI), _cut),
        "HIGHRES_IMU": Source("mavlink", _FINE, _single),
        "one decimal of a degree": _lines(0.1 * DEG),
        "two decimals of a degree": _lines(0.01 * DEG),
        "two decimals of a degree, not stated": _lines(0.01 * DEG, stated=False),
        "three decimals of a converter's counts": _lines(1e-3 * DEG, of_a_converter=OF_16_BITS_RAD_S),
        "three decimals of a radian, not stated": _lines(MILLI, stated=False),
    }
)


@dataclass(frozen=True, slots=True)
class Stated:
    """A recording's result: errors of scale and bias (6,), their U (6,), the names of failed checks."""

    error: Array
    expanded: Array
    failed: tuple[str, ...]


def record(source: Source, seed: int, noise_rad_s: float, *, vibrates: bool) -> Drawn:
    """Return a recording of a source, drawn within its part's data sheet and the arm's limits."""
    channels = (source.channel, thermometer_channel(0.01, 0.0))
    sensor = replace(SENSOR, part=source.part, rate_hz=100.0, channels=channels, clock="gyro")
    flicker_rad_s = float(np.radians(PARTS[source.part].bias_instability_deg_h / 3600))
    kind = Kind(sensor, noise_rad_s, flicker_rad_s, 1e-6, source.sent)
    return drawn(seed, kind, vibrates=vibrates)


def state_solution(recording: Drawn) -> Stated:
    """Return the solution of a recording, compared with its truth."""
    recordings = observe_recordings([recording.run])
    environment = find_environment(recordings, recording.run.settings)
    results = solve_observed(recording.run.sensors, recordings, environment=environment)
    result = results["gyro"]
    assert result.uncertainty is not None
    (observed,) = recordings
    averages = [turn.average for turn in observed.sensors["gyro"].revolutions] + [*observed.sensors["gyro"].rests]
    first_s, last_s = min(average.start_s for average in averages), max(average.end_s for average in averages)
    inside = (recording.time_s >= first_s) & (recording.time_s <= last_s)
    true = np.concatenate([recording.scale, -recording.bias_rad_s[inside].mean(axis=0)])
    checks = contradictions(recordings, results, ["gyro"], environment, recording.run.settings, has_limits=False).checks
    return Stated(
        np.concatenate([result.scale, result.bias_rad_s]) - true,
        result.uncertainty.expanded,
        tuple(check.name for check in checks if not check.passed),
    )
