"""Two results of one recording, held against each other by what their numbers mean: by the uncertainty they state.

A processor's rounding is no difference, and neither is the order in which its kernel adds.
"""

from collections.abc import Iterator, Sequence

from rig.data.earth_rate_entries import EarthRateEntry
from rig.data.result_file import ComparisonEntry, ResultDocument
from rig.history.parameters import calibrated

SHARE = 1e-6  # of the standard uncertainty; an uncertainty itself is held by a share of its own size


def differences(expected: ResultDocument, found: ResultDocument) -> list[str]:
    """Every number of `expected` that `found` lacks or has otherwise; what was added since may be there."""
    numbers = {name: value for name, value, _ in _stated(found)}
    told = [
        f"{name}: {value!r} (± {std:.2g}) became {numbers.get(name)!r}"
        for name, value, std in _stated(expected)
        if name not in numbers or not abs(numbers[name] - value) <= SHARE * std
    ]
    passed = {check.name: check.passed for check in found.checks}
    told += [
        f"check {check.name}: {check.passed} became {passed.get(check.name)}"
        for check in expected.checks
        if passed.get(check.name) is not check.passed
    ]
    return told if expected.verdict == found.verdict else [*told, f"the verdict became {found.verdict}"]


def _stated(document: ResultDocument) -> Iterator[tuple[str, float, float]]:
    """What a result states: its name, its value, and the standard uncertainty that it is held by."""
    for sensor in calibrated(document):
        of = f"{sensor.sensor} {sensor.quantity}"
        for each in sensor.parameters:
            yield f"{of} {each.name}", each.value, each.std
            yield f"{of} u({each.name})", each.std, each.std
            yield f"{of} s({each.name})", each.std_statistical, each.std_statistical
    for name, gyroscope in document.sensors.items():
        if isinstance(gyroscope.earth_rate, EarthRateEntry):
            stds = [gyroscope.earth_rate.covariance_rad2_s2[i][i] ** 0.5 for i in range(3)]
            yield from _vector(f"{name} Earth's rate", gyroscope.earth_rate.rate_rad_s, stds)
    for name, accelerometer in document.accelerometers.items():
        if accelerometer.lever_arm_m is not None and accelerometer.lever_arm_std_m is not None:
            yield from _vector(f"{name} lever arm", accelerometer.lever_arm_m, accelerometer.lever_arm_std_m)
    for name, against in document.verification.items():
        yield from _vector(f"{name} rotation", against.rotation.vector_rad, against.rotation.std_rad)
        yield from _turns(f"{name} after", against.after)
        if against.before is not None:
            yield from _turns(f"{name} before", against.before)
    for name, drifts in document.bias_drift.items():
        for quantity, drift in drifts.items():
            for i, repeat in enumerate(drift.repeats):
                yield from _vector(f"{name} {quantity} repeat {i}", repeat.held.bias, repeat.held.std)


def _turns(name: str, compared: ComparisonEntry) -> Iterator[tuple[str, float, float]]:
    for turn in compared.revolutions:
        yield from _vector(f"{name} sweep {turn.sweep}", turn.error_rad_s, turn.std_rad_s)


def _vector(name: str, values: Sequence[float], stds: Sequence[float]) -> Iterator[tuple[str, float, float]]:
    for axis, value, std in zip("xyz", values, stds, strict=True):
        yield f"{name} {axis}", value, std
        yield f"{name} s({axis})", std, std
