"""Results of recordings of hidden worlds, compared with the drawn truth."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from rig.analysis.check import Check
from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.analysis.outcome import Outcome
from rig.analysis.reference.accelerometer import AccelerometerResult
from rig.config.load import parse
from rig.config.world.laboratory import SimulatedSensorSection
from rig.errors import RigError
from rig.estimation.gyroscope.budget import Budget
from rig.observation.observed_run import ObservedRun
from rig.plans.recorded_run import judge_phases, open_run
from rig.world.world_section import read_world_section
from support.laboratories.drawn_laboratory import bias_at_0_g, truth

SCALE, BIAS = "gyroscope scale", "gyroscope bias"
OF_GRAVITY = "accelerometer scale", "accelerometer bias"


@dataclass(frozen=True, slots=True)
class Stated:
    """Three values of one sensor: their errors, their u and their U, each (3,)."""

    part: str
    parameter: str
    error: np.ndarray
    std: np.ndarray
    expanded: np.ndarray


@dataclass(frozen=True, slots=True)
class Judged:
    """A solved recording: its stated values, its checks, and the name of the fault that ended it, if any."""

    folder: Path
    stated: tuple[Stated, ...]
    checks: tuple[Check, ...]
    fault: str | None

    @property
    def refused(self) -> tuple[str, ...]:
        """The reasons why the recording did not pass; empty for an undamaged one."""
        failed = tuple(check.name for check in self.checks if not check.passed)
        return failed if self.fault is None else (self.fault, *failed)


def solve(folder: Path) -> Judged:
    """Solve the run in `folder`/run, whose laboratory is `folder`/config.yaml, by the present code."""
    document: dict[str, Any] = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
    try:
        outcome = judge_phases(open_run(folder / "run"), DEFAULT_ESTIMATOR)
    except RigError as error:
        return Judged(folder, (), (), error.name)
    return Judged(folder, tuple(_list_stated(outcome, document)), outcome.checks, None)


def _list_stated(outcome: Outcome, document: Mapping[str, Any]) -> Iterable[Stated]:
    (recording,) = outcome.recordings
    for name, result in outcome.results.items():
        if name not in outcome.settings.to_calibrate:
            continue
        assert result.uncertainty is not None
        speed_rad_s = float(np.mean([observation.speed_rad_s for observation in result.observations]))
        true = true_gyroscope(document, name, recording, speed_rad_s)
        values = np.concatenate([result.scale, result.bias_rad_s])
        yield from _split(result.sensor.part, (SCALE, BIAS), values - true, result.uncertainty)
    for name, accelerometer in outcome.accelerometers.items():
        assert accelerometer.budget is not None
        values = np.concatenate([accelerometer.triad.scale, accelerometer.bias_m_s2])
        error = values - true_accelerometer(document, name, accelerometer)
        yield from _split(accelerometer.sensor.part, OF_GRAVITY, error, accelerometer.budget)


def true_gyroscope(document: Mapping[str, Any], name: str, recording: ObservedRun, speed_rad_s: float) -> np.ndarray:
    """Return the true scale over the sweeps' times and the true bias over all averages, together (6,)."""
    recorded = recording.sensors[name]
    sweeps = [(turn.average.start_s, turn.average.end_s) for turn in recorded.revolutions]
    averages = [*sweeps, *((rest.start_s, rest.end_s) for rest in recorded.rests)]
    whole = min(start_s for start_s, _ in averages), max(end_s for _, end_s in averages)
    scale = truth(document, name, sweeps, speed_rad_s)[:3]
    return np.concatenate([scale, truth(document, name, [whole], speed_rad_s)[3:]])


def true_accelerometer(document: Mapping[str, Any], name: str, result: AccelerometerResult) -> np.ndarray:
    """Return (6,) the scale of the readings at 1 g up and down, and the bias, by the reading at 0 g.

    Neither depends on φ, because an even term is the same up and down, and zero at 0 g. The scale is that at the mean
    temperature of dwells and sweeps, the bias its mean over the run, as docs/uncertainty.md defines it: it includes the
    drift during sweeps and between the dwells.
    """
    sensor = read_world_section(parse(yaml.safe_dump(dict(document)))).sensors[name]
    drawn = sensor.accelerometer
    assert result.movement.sensor_errors is not None
    windows_s = result.movement.sensor_errors.windows_s
    warmer_k = np.average(
        [_warmer_k(sensor, middle_s) for middle_s in windows_s.mean(axis=1)], weights=np.ptp(windows_s, axis=1)
    )
    scale = np.array(drawn.scale) * (1 + float(warmer_k) * np.array(drawn.scale_per_k))
    whole = float(windows_s.min()), float(windows_s.max())
    return np.concatenate([scale, bias_at_0_g(document, name, [whole])])


def _warmer_k(sensor: SimulatedSensorSection, time_s: float) -> float:
    """Return the temperature of a part, powered at time zero, above `temperature_c`, where its errors are valid, K."""
    if sensor.start_temperature_c is None:
        return 0.0
    return float((sensor.start_temperature_c - sensor.temperature_c) * np.exp(-time_s / sensor.warm_up_s))


def _split(part: str, names: Sequence[str], error: np.ndarray, budget: Budget) -> Iterable[Stated]:
    for name, axes in zip(names, (slice(0, 3), slice(3, 6)), strict=True):
        yield Stated(part, name, error[axes], budget.std[axes], budget.expanded[axes])


@dataclass(frozen=True, slots=True)
class Held:
    """Agreement of the stated values of one kind of parameter with the truth: a line of the table."""

    values: int
    rms: float
    within: float
    largest: float
    std: tuple[float, float, float]

    def __str__(self) -> str:
        low, middle, high = self.std
        return (
            f"{self.values:4d} values: RMS {self.rms:.2f} u, {100 * self.within:5.1f} % within U, "
            f"largest {self.largest:.2f} U; u {low:.3g}, {middle:.3g}, {high:.3g} ({high / low:.1f}-fold)"
        )


def compare_with_truth(runs: Iterable[Judged]) -> dict[tuple[str, str], Held]:
    """Compare stated values with the truth, by part and parameter."""
    by_key: dict[tuple[str, str], list[Stated]] = {}
    for run in runs:
        for value in run.stated:
            by_key.setdefault((value.part, value.parameter), []).append(value)
    return {key: _compare_one(value) for key, value in sorted(by_key.items())}


def _compare_one(stated: Sequence[Stated]) -> Held:
    error, std, expanded = (
        np.concatenate(arrays) for arrays in zip(*((one.error, one.std, one.expanded) for one in stated), strict=True)
    )
    beyond = np.abs(error) / expanded
    return Held(
        len(error),
        float(np.sqrt(np.mean((error / std) ** 2))),
        float(np.mean(beyond <= 1)),
        float(beyond.max()),
        (float(std.min()), float(np.median(std)), float(std.max())),
    )
