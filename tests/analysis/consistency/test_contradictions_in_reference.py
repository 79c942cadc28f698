"""Nothing passes that contradicts itself, of accelerometers and magnetometers: damages, and recordings as made."""

import numpy as np
import pytest
import yaml

from rig.analysis.analyses import calibrate
from rig.analysis.consistency.contradictions import contradicting_sweeps
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.reference.accelerometer import calibrate_accelerometers
from rig.errors import Fault
from support.paths import RECORDINGS
from support.recordings.damaged_accelerations import (
    Damage,
    Mask,
    Readings,
    bent,
    convert,
    find_contradictions,
    load_recording,
    offset,
    readings_of,
    rotate,
    scale,
    spike,
    stuck,
)

IMU, COMPASS, KVH = "imu", "magnetometer", "earth_rate"
GRAVITY_M_S2 = 9.80665
UNDAMAGED = [IMU, COMPASS, "bias_drift"]

pytestmark = pytest.mark.slow


def late(seen: Readings) -> Mask:
    return seen.late


def turning(seen: Readings) -> Mask:
    return seen.turning


def dwell_3(seen: Readings) -> Mask:
    return seen.dwell(3)


def half_of_dwell_3(seen: Readings) -> Mask:
    return seen.half_of_dwell(3)


def sweep_4(seen: Readings) -> Mask:
    return seen.sweep(4)


# What is damaged, and the names of which one at least must be told. The sizes are about twice the smallest that are.
DAMAGES: dict[str, tuple[tuple[str, ...], Damage]] = {
    "even nonlinearity of 2 % of v²/g": (("even_term",), bent(lambda felt: 2e-2 * felt**2 / GRAVITY_M_S2)),
    "asymmetry of 0.2 %": (("asymmetry",), bent(lambda felt: 2e-3 * np.abs(felt))),
    "odd nonlinearity of 1.5 % of v³/g²": (("odd_term",), bent(lambda felt: 1.5e-2 * felt**3 / GRAVITY_M_S2**2)),
    "0.008 m/s² in sweeps only": (("sweeps_against_dwells",), offset(0.008, turning)),
    "turned by 0.06° half-way": (("loose_mounting",), rotate(0.06, late)),
    "bias changes by 0.01 m/s² half-way": (("bias_changed", "sweeps_against_dwells"), offset(0.01, late)),
    "scale changes by 0.04 % half-way": (("scale_changed",), scale(1.0004, late)),
    "one axis' scale changes by 0.1 % half-way": (("scale_changed",), scale(1.001, late, (0,))),
    "0.02 m/s² in one dwell": (("disturbed_dwell",), offset(0.02, dwell_3)),
    "turned by 0.2° in one dwell": (("disturbed_dwell",), rotate(0.2, dwell_3)),
    "a step of 0.02 m/s² in a dwell": (("knocked_dwell",), offset(0.02, half_of_dwell_3)),
    "0.02 m/s² in one sweep": (("disturbed_sweep", "disturbed_dwell"), offset(0.02, sweep_4)),
    "a reading off by 0.5 m/s² in a dwell": (("spikes",), spike(0.5, dwell_3)),
    "low byte always 0": (("stuck_bit", "attitude_untrustworthy"), convert(lambda counts: counts & ~0xFF)),
    "bit 3 always high": (("stuck_bit",), convert(lambda counts: counts | 8)),
    "bit 0 always low": (("stuck_bit",), convert(lambda counts: counts & ~1)),
    "an axis stuck in a dwell": (("stuck_axis",), stuck(0, dwell_3)),
    "an axis stuck in a sweep": (("stuck_sensor",), stuck(1, sweep_4)),
    "an axis stuck at 3 m/s² in a dwell": (("attitude_untrustworthy",), stuck(2, dwell_3, 3.0)),
    "clips at 9.5 m/s²": (
        ("clipping", "stuck_axis", "attitude_untrustworthy"),
        bent(lambda felt: felt.clip(-9.5, 9.5) - felt),
    ),
}
MICROTESLA = 1e-6
NOT_UNIFORM, DRIFTS = "field_not_uniform", "field_drifts"  # a magnetometer's own tests refuse most of it
FIELD_DAMAGES: dict[str, tuple[tuple[str, ...], Damage]] = {
    "even nonlinearity of 0.2 % of v²/50 µT": (
        ("even_term", NOT_UNIFORM),
        bent(lambda felt: 2e-3 * felt**2 / (50 * MICROTESLA)),
    ),
    "asymmetry of 1 %": (("asymmetry", NOT_UNIFORM), bent(lambda felt: 1e-2 * np.abs(felt))),
    "bias changes by 0.3 µT half-way": (("bias_changed", DRIFTS), offset(0.3 * MICROTESLA, late)),
    "0.3 µT in one dwell": (("disturbed_dwell", NOT_UNIFORM), offset(0.3 * MICROTESLA, dwell_3)),
    "a step of 0.6 µT in a dwell": (("knocked_dwell",), offset(0.6 * MICROTESLA, half_of_dwell_3)),
    "a reading off by 10 µT in a dwell": (("spikes",), spike(10 * MICROTESLA, dwell_3)),
    "bit 0 always low": (("stuck_bit",), convert(lambda counts: counts & ~1)),
    "an axis stuck in a dwell": (("stuck_axis",), stuck(1, dwell_3)),
}


def first_of_its_kind(damages: dict[str, tuple[tuple[str, ...], Damage]], name: str) -> bool:
    """Whether no damage before this one in the table is to be told by the same names."""
    return name == next(each for each, (names, _) in damages.items() if names == damages[name][0])


def all_or_first(damages: dict[str, tuple[tuple[str, ...], Damage]]) -> list[object]:
    """The names, of which all but the first of a kind have time in `make proof` alone."""
    return [
        name
        if first_of_its_kind(damages, name)
        else pytest.param(name, marks=[pytest.mark.proof, pytest.mark.thorough])
        for name in damages
    ]


def named(folder: str, sensor: str, damage: Damage, prefix: str) -> set[str]:
    """What is told of a damaged recording: names of checks that failed, or of the refusal."""
    try:
        told = find_contradictions(damage(readings_of(folder, sensor)).recording())
    except Fault as fault:
        return {fault.name}
    return {*told.refused, *(name.removeprefix(prefix) for name in told.failed if name.startswith(prefix))}


@pytest.mark.one_in(10)
@pytest.mark.parametrize("name", all_or_first(DAMAGES))
def test_what_is_damaged_of_an_accelerometer_is_named(name: str) -> None:
    names, damage = DAMAGES[name]
    assert named(IMU, "gyro", damage, "acceleration_") & set(names)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", all_or_first(FIELD_DAMAGES))
def test_what_is_damaged_of_a_magnetometer_is_named(name: str) -> None:
    names, damage = FIELD_DAMAGES[name]
    assert named(COMPASS, "compass", damage, "field_") & set(names)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("folder", UNDAMAGED)
def test_a_recording_as_it_was_made_contradicts_nothing(folder: str) -> None:
    assert find_contradictions(load_recording(folder)).failed == set()


@pytest.mark.thorough
def test_a_sensor_that_is_no_more_bent_than_its_data_sheet_says_is_within_its_uncertainty() -> None:
    """The simulated KVH 1775 has 0.09 % of v²/g on one axis, and the run did not look for it."""
    run = load_recording(KVH)
    found = calibrate_accelerometers(observe_recordings([run]), run.settings).results["kvh"]
    truth = yaml.safe_load((RECORDINGS / KVH / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["kvh"][
        "accelerometer"
    ]
    assert find_contradictions(run).failed == set()
    off = np.concatenate([found.triad.scale - truth["scale"], found.bias_m_s2 - truth["bias_m_s2"]])
    assert np.all(np.abs(off) < found.budget.expanded)


def test_the_disturbed_dwell_is_named_and_fails_the_verdict() -> None:
    outcome = calibrate([offset(0.02, dwell_3)(readings_of(IMU, "gyro")).recording()])
    assert not outcome.passed
    assert [check.name for check in outcome.checks if not check.passed] == ["gyro.acceleration_disturbed_dwell.15"]


def test_a_sweep_that_only_the_accelerometer_feels_to_be_disturbed_is_repeated_as_one_of_a_gyroscope_is() -> None:
    run = offset(0.02, sweep_4)(readings_of(IMU, "gyro")).recording()
    failed = {check.name: check.means.sweep for check in calibrate([run]).checks if not check.passed}
    assert failed == {"gyro.acceleration_disturbed_sweep.4": 4, "gyro.acceleration_residuals": None}
    assert contradicting_sweeps([run]) == {4}


@pytest.mark.thorough  # that it is named as a dwell, test_the_disturbed_dwell_is_named_and_fails_the_verdict
def test_a_disturbed_dwell_is_no_sweep_that_is_repeated() -> None:
    assert contradicting_sweeps([offset(0.02, dwell_3)(readings_of(IMU, "gyro")).recording()]) == frozenset()


def test_a_bias_that_drifts_contradicts_nothing_where_it_is_watched() -> None:
    drifting = find_contradictions(load_recording("bias_drift"))
    assert "gyro.acceleration_bias_changed" in {check.name for check in drifting.checks}
    outcome = calibrate([load_recording("bias_drift")], drifting=True)
    names = {check.name for check in outcome.checks}
    assert "gyro.acceleration_bias_changed" not in names and "gyro.acceleration_scale_changed" in names


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("folder", "sensor", "axis", "at_m_s2"),
    [(IMU, "gyro", 0, 0.0), (IMU, "gyro", 2, -9.8), (COMPASS, "lsm9ds1", 1, 3.0), (KVH, "kvh", 2, 3.0)],
)
def test_whatever_an_axis_reads_in_a_dwell_the_answer_has_a_name(
    folder: str, sensor: str, axis: int, at_m_s2: float
) -> None:
    assert named(folder, sensor, stuck(axis, dwell_3, at_m_s2), "acceleration_")
