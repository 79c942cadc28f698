"""Comparison of two results of one recording by their stated uncertainties.

Another processor's rounding is no difference, nor is the order of its additions.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.result_file import (
    AverageEntry,
    CheckEntry,
    ComparisonEntry,
    ObservationEntry,
    ResultDocument,
    read_result,
)
from rig.report.findings.history_records import Parameter
from rig.report.kinds.kind_registry import history_records

SHARE = 1e-6
Number = tuple[str, float, float]  # name, value, and the quantity of which it may change by a share


def differences(expected: ResultDocument, actual: ResultDocument) -> list[str]:
    """Return every number of `expected` that differs in `actual` or is missing, with verdict and checks.

    A value is compared by its standard uncertainty, an uncertainty by its own size, a check by its limit, a count
    exactly.
    """
    moved = _list_moved(_numbers(expected), _numbers(actual))
    summaries = {check.name: _summarise(check) for check in actual.checks}
    moved += [
        f"check {check.name}: {_summarise(check)}, now {summaries.get(check.name)}"
        for check in expected.checks
        if summaries.get(check.name) != _summarise(check)
    ]
    return (
        moved if expected.verdict == actual.verdict else [*moved, f"verdict: {expected.verdict}, now {actual.verdict}"]
    )


def _summarise(check: CheckEntry) -> tuple[object, ...]:
    """Return whether a check passed and its subject; a fitness check may add to its subject in a later version."""
    means = check.means
    return check.passed, means if means.kind == "conformity" else (means.kind, means.sweep)


def find_differences(run: Path, printed: str) -> list[str]:
    """Return the differences between a run's result and the output of `rig solve --json`."""
    return differences(read_result(run), ResultDocument.model_validate_json(printed))


def find_moved_parameters(expected: Iterable[Parameter], actual: Iterable[Parameter]) -> list[str]:
    """Return the differences of one sensor's parameters."""
    return _list_moved(_parameter_numbers("", expected), _parameter_numbers("", actual))


def _list_moved(expected: Iterable[Number], actual: Iterable[Number]) -> list[str]:
    values = {name: value for name, value, _ in actual}
    return [
        f"{name}: {value!r} (± {std:.2g}), now {values.get(name)!r}"
        for name, value, std in expected
        if name not in values or not abs(values[name] - value) <= SHARE * std
    ]


def _numbers(document: ResultDocument) -> Iterator[Number]:
    for sensor in history_records(document):
        yield from _parameter_numbers(f"{sensor.sensor} {sensor.quantity} ", sensor.parameters)
    for check in document.checks:
        if check.value is not None:
            yield f"check {check.name}", check.value, abs(check.limit or 0.0)
    yield from _gyroscope_numbers(document)
    yield from _attitude_numbers(document)
    for name, against in document.verification.items():
        yield from _vector(f"{name} rotation", against.rotation.vector_rad, against.rotation.std_rad)
        yield from _comparison_numbers(f"{name} after", against.after)
        if against.before is not None:
            yield from _comparison_numbers(f"{name} before", against.before)
    for name, drifts in document.bias_drift.items():
        for quantity, drift in drifts.items():
            for i, repeat in enumerate(drift.repeats):
                yield from _vector(f"{name} {quantity} repeat {i}", repeat.scale_fixed.bias, repeat.scale_fixed.std)


def _gyroscope_numbers(document: ResultDocument) -> Iterator[Number]:
    for name, gyroscope in document.gyroscopes.items():
        averages: list[ObservationEntry | AverageEntry] = [*gyroscope.observations, *gyroscope.rests]
        for i, average in enumerate(averages):
            yield f"{name} average {i} samples", average.samples, 0.0
            yield from _vector(f"{name} average {i}", average.mean_rad_s, average.mean_std_rad_s)
        if isinstance(gyroscope.earth_rate, EarthRateEntry):
            stds = [gyroscope.earth_rate.covariance_rad2_s2[i][i] ** 0.5 for i in range(3)]
            yield from _vector(f"{name} Earth's rate", gyroscope.earth_rate.rate_rad_s, stds)


def _attitude_numbers(document: ResultDocument) -> Iterator[Number]:
    for name, accelerometer in document.accelerometers.items():
        for dwell in accelerometer.dwells:
            yield from _vector(f"{name} acceleration in {dwell.index}", dwell.mean_m_s2, dwell.mean_std_m_s2)
        if accelerometer.lever_arm_m is not None and accelerometer.lever_arm_std_m is not None:
            yield from _vector(f"{name} lever arm", accelerometer.lever_arm_m, accelerometer.lever_arm_std_m)
    for name, magnetometer in document.magnetometers.items():
        if isinstance(magnetometer, MagnetometerEntry):
            for field_dwell in magnetometer.dwells:
                yield from _vector(f"{name} field in {field_dwell.index}", field_dwell.mean_t, field_dwell.mean_std_t)


def _parameter_numbers(subject: str, parameters: Iterable[Parameter]) -> Iterator[Number]:
    for parameter in parameters:
        yield f"{subject}{parameter.name}", parameter.value, parameter.std
        yield f"{subject}u({parameter.name})", parameter.std, parameter.std
        yield f"{subject}s({parameter.name})", parameter.std_statistical, parameter.std_statistical


def _comparison_numbers(name: str, compared: ComparisonEntry) -> Iterator[Number]:
    rms = compared.movement.rms_rad_s
    yield from ((f"{name} rms {axis}", size, size) for axis, size in zip("xyz", rms, strict=True))
    for turn in compared.revolutions:
        yield from _vector(f"{name} sweep {turn.sweep}", turn.error_rad_s, turn.std_rad_s)


def _vector(name: str, values: Sequence[float], stds: Sequence[float]) -> Iterator[Number]:
    for axis, value, std in zip("xyz", values, stds, strict=True):
        yield f"{name} {axis}", value, std
        yield f"{name} s({axis})", std, std
