"""Calibrated readings beside a reference: relative rotation, errors as computed by hand, noise, refusals, plots."""

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from firmware_host.installation import install_command
from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.comparison import Reference
from rig.analysis.gyroscope.verification import Verification, verify
from rig.analysis.verdict import verdict, verification_checks
from rig.config.judging.verdict_limits import Limits
from rig.data.recording.recorded_events import SweepStarted
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.observation.windows import iterate_rests
from rig.report.figures.verification import draw_verifications
from rig.report.kinds.verification import verification_entry, verification_lines, verification_table
from rig.station.events import Plotted
from rig.station.words import line
from support.recordings.solving import solve_runs
from support.recordings.synthetic_run import SCALE, Setup
from support.recordings.synthetic_verification import REFERENCE, TRUTH, Stored, recording

pytestmark = pytest.mark.slow

KNOWN = Reference("reference", np.array(REFERENCE.scale), np.array(REFERENCE.bias_rad_s))
QUIET = Setup(noise_rad_s=0.002)
TURN_RATE = np.pi / 3


@cache
def movement() -> RunData:
    """The calibration's movement."""
    return recording(QUIET)


@cache
def calibrated_gyro() -> SensorResult:
    return solve_runs([movement()])["gyro"]


@cache
def repetition() -> RunData:
    solution = calibrated_gyro().solution
    setup = replace(QUIET, seed=2, boot_s=33.0)
    return recording(setup, stored=Stored(solution.scale, solution.bias_rad_s), lag_s=0.004)


@cache
def seen_before() -> tuple[ObservedRun, ...]:
    return observe_runs([movement()])


@cache
def seen_after() -> tuple[ObservedRun, ...]:
    return observe_runs([repetition()])


@cache
def verified() -> Verification:
    return verify("gyro", KNOWN, seen_after(), seen_before(), calibrated_gyro())


def test_the_whole_matrix_leaves_no_error_where_the_axes_are_not_at_right_angles() -> None:
    """The diagonal leaves half of 0.3° times the speed, 2.7e-3 rad/s; the rotation found is the same."""
    lean = np.array([[1.0, 0.0052, -0.0035], [0.0, 1.0, 0.0044], [0.0, 0.0, 1.0]])
    axes = lean / np.linalg.norm(lean, axis=1)[:, None]
    made, again = recording(QUIET, axes=axes), replace(QUIET, seed=2, boot_s=33.0)
    worst = {}
    turned = {}
    for kind, corrected in {"matrix": ["gyro"], "diagonal": list[str]()}.items():
        found = solve_runs([made], matrix_corrected=corrected)["gyro"]
        assert found.correction == kind
        repeated = recording(again, stored=found, axes=axes)
        verified = verify("gyro", KNOWN, observe_runs([repeated]), observe_runs([made]), found)
        worst[kind] = max(np.abs(turn.error_rad_s).max() for turn in verified.after.revolutions)
        turned[kind] = verified.rotation.matrix
        noise = verified.after.noise_rad_s
        if kind == "matrix":
            assert noise is not None and np.all(verified.after.movement.rms_rad_s < 1.05 * noise)
    assert worst["matrix"] < 3e-4 and worst["diagonal"] > 2e-3
    assert np.allclose(turned["matrix"], turned["diagonal"], atol=2e-5), "the frame is the one nearest to the axes"


def rotation(vector: tuple[float, ...]) -> Array:
    from scipy.spatial.transform import Rotation

    matrix: Array = Rotation.from_rotvec(vector).as_matrix()
    return matrix


def departure(found: Array) -> Array:
    """Rotation vector by which a relative rotation departs from the truth, in the sensor's frame."""
    from scipy.spatial.transform import Rotation

    true = rotation(QUIET.mounting_error_rad) @ rotation(REFERENCE.mounting_error_rad).T
    vector: Array = Rotation.from_matrix(found @ true.T).as_rotvec()
    return vector


@pytest.mark.proof
def test_how_the_two_sensors_sit_to_each_other_is_found_within_its_uncertainty(thorough: bool) -> None:
    deviations = []
    for seed in range(6 if thorough else 2):
        setup = replace(QUIET, seed=seed, noise_rad_s=0.02, rest_s=0.5, speed_deg_s=120.0)
        run = recording(setup, stored=TRUTH)
        found = verify("gyro", KNOWN, observe_runs([run])).rotation
        deviations.append(departure(found.matrix) / found.std_rad)
        assert np.linalg.norm(found.vector_rad) == pytest.approx(np.linalg.norm(found.from_nominal_rad))
    assert (0.6 if thorough else 0.4) < np.sqrt(np.mean(np.square(deviations))) < (1.5 if thorough else 1.8)
    assert np.abs(deviations).max() < 4


def test_the_rotation_is_told_by_the_calibration_where_there_is_one() -> None:
    """Its revolutions, corrected, fit the reference's to within their noise; nothing is taken from the repetition."""
    assert np.all(np.abs(departure(verified().rotation.matrix)) < 4 * verified().rotation.std_rad)
    assert np.abs(verified().rotation.residuals_rad_s).max() < 4e-4
    assert not np.array_equal(verified().rotation.matrix, verify("gyro", KNOWN, seen_after()).rotation.matrix)


def test_a_verification_without_its_calibration_has_no_before() -> None:
    alone = verify("gyro", KNOWN, seen_after())
    assert alone.before is None
    np.testing.assert_allclose(alone.after.movement.rms_rad_s, verified().after.movement.rms_rad_s, rtol=1e-3)


def by_hand(scale: tuple[float, ...], bias_rad_s: tuple[float, ...]) -> Array:
    """(3,) mean square over sweeps and rests: of all that time an axis turns during two sweeps, with their ramps.

    With reading m = g/k − b, the error is (1/k − 1) g − b, and g as often positive as negative.
    """
    sweep_s, even_s, ramp_s, rest_s = 6.5667, 6.0667, 0.25, 3.0
    turning = 2 * (even_s + 2 * ramp_s / 3) / (6 * (sweep_s + rest_s)) * TURN_RATE**2
    error: Array = (1 / np.array(scale) - 1) ** 2 * turning + np.array(bias_rad_s) ** 2
    return error


MPU9250 = ((1.0065, 0.9955, 0.9950), (0.0411, -0.0099, 0.0101))  # by turntable, SIX, Table III


def before(scale: tuple[float, ...], bias_rad_s: tuple[float, ...]) -> Array:
    """(3,) mean square of an uncalibrated sensor's error, sensor and reference mounted straight, without noise."""
    plain = Setup(
        scale=scale, bias_rad_s=bias_rad_s, noise_rad_s=0.0, mounting_error_rad=(0.0, 0.0, 0.0), vibration=0.0
    )
    known = replace(REFERENCE, noise_rad_s=0.0, mounting_error_rad=(0.0, 0.0, 0.0))
    true = Stored(np.array(scale), np.array(bias_rad_s))
    after = recording(plain, reference=known, stored=true)
    found = verify("gyro", KNOWN, observe_runs([after]), observe_runs([recording(plain, reference=known)]), true).before
    assert found is not None
    return found.movement.mse_rad2_s2


@pytest.mark.thorough
def test_the_error_before_is_what_scale_and_bias_make_it() -> None:
    for scale, bias_rad_s in ((SCALE, (0.0077, -0.0100, -0.0051)), MPU9250):
        np.testing.assert_allclose(before(scale, bias_rad_s), by_hand(scale, bias_rad_s), rtol=0.02)


def test_the_published_errors_are_mean_squares_in_degrees_brought_to_radians_once() -> None:
    """SIX, Tables IV and V, "rad/s": (°/s)² · π/180. What calibration does not remove is subtracted where it matters.

    No RMS in rad/s can be meant: during a sweep the LSM9DS1 errs by 0.165 rad/s at most, the table has 0.28.
    """
    published_unit = np.radians(np.degrees(1.0) ** 2)
    lsm9ds1 = by_hand(SCALE, (0.0077, -0.0100, -0.0051)) * published_unit
    np.testing.assert_allclose(lsm9ds1, [0.2798 - 0.0052, 0.2255 - 0.0093, 0.1940 - 0.0022], rtol=0.18)
    mpu9250 = by_hand(*MPU9250) * published_unit
    np.testing.assert_allclose(mpu9250, [0.1031 - 0.0051, 0.0107 - 0.0057, 0.0096 - 0.0033], rtol=0.18)


def test_the_error_after_is_both_sensors_noise() -> None:
    after = verified().after
    assert after.noise_rad_s is not None
    spline = 0.9  # a spline through white noise has about this much of it between the points
    both = np.hypot(np.array(SCALE) * QUIET.noise_rad_s, spline * REFERENCE.noise_rad_s)
    np.testing.assert_allclose(after.noise_rad_s, both, rtol=0.04)
    np.testing.assert_allclose(after.movement.rms_rad_s, after.noise_rad_s, rtol=0.03)
    np.testing.assert_allclose(after.sweeps.rms_rad_s, after.noise_rad_s, rtol=0.04)
    assert after.movement.samples > after.sweeps.samples > 6 * 6.5 * 238
    error = after.reading_rad_s - after.reference_rad_s
    assert len(error) == len(after.time_s) > after.movement.samples  # the ways between are there, but do not count
    assert np.all(np.abs(error).max(axis=0) >= after.movement.max_rad_s)


def test_over_whole_turns_the_noise_averages_out() -> None:
    """What is left is the calibration's own error."""
    uncertain = np.sqrt(np.diag(calibrated_gyro().solution.covariance))
    for turn in verified().after.revolutions:
        calibrated = uncertain[:3] * TURN_RATE + uncertain[3:] * calibrated_gyro().solution.scale
        assert np.all(np.abs(turn.error_rad_s) < 4 * np.hypot(turn.std_rad_s, calibrated))
        assert turn.std_rad_s.max() < 1e-4
    before = verified().before
    assert before is not None
    assert [(turn.joint_name, turn.direction) for turn in before.revolutions] == [
        (turn.joint_name, turn.direction) for turn in verified().after.revolutions
    ]


def test_a_wrong_calibration_is_seen_axis_by_axis() -> None:
    wrong = Stored(TRUTH.scale * [1.01, 1.0, 1.0], TRUTH.bias_rad_s + np.array([0.0, 0.003, 0.0]))
    setup = replace(QUIET, mounting_error_rad=(0.0, 0.0, 0.0), rest_s=1.0)
    after = verify("gyro", KNOWN, observe_runs([recording(setup, stored=wrong)])).after
    for turn in after.revolutions:
        along = {"wrist_1": 1.0, "wrist_2": 0.0, "wrist_3": 0.0}[str(turn.joint_name)]
        assert abs(turn.error_rad_s[0]) == pytest.approx(0.01 * TURN_RATE * along, abs=4e-4)
        assert turn.error_rad_s[1] == pytest.approx(0.003 * SCALE[1], abs=4e-4)
    assert after.movement.mean_rad_s[1] == pytest.approx(0.003 * SCALE[1], abs=2e-4)


def test_the_filters_delay_is_told_and_taken_out() -> None:
    (delay_s,), (std_s,) = verified().after.delay_s, verified().after.delay_std_s
    assert delay_s == pytest.approx(0.004, abs=4 * std_s)
    assert std_s < 1e-4
    before = verified().before
    assert before is not None
    assert abs(before.delay_s[0]) < 4 * before.delay_std_s[0]


def test_axes_that_are_not_at_right_angles_stay_an_error() -> None:
    """No rotation takes y's share of x out: half of it is turned away, half remains on either axis."""
    share = 0.01
    askew = np.array([[1.0, share, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    setup = replace(QUIET, mounting_error_rad=(0.0, 0.0, 0.0), rest_s=1.0)
    found = verify("gyro", KNOWN, observe_runs([recording(setup, stored=TRUTH, axes=askew)]))
    expected = {"wrist_1": (0.0, 1.0), "wrist_2": (1.0, 0.0), "wrist_3": (0.0, 0.0)}
    for turn in found.after.revolutions:
        shares = np.abs(turn.error_rad_s[:2]) / (share / 2 * TURN_RATE)
        np.testing.assert_allclose(shares, expected[str(turn.joint_name)], atol=0.06)


def test_the_recordings_of_a_resumed_run_count_together() -> None:
    def part(sweeps: range) -> RunData:
        current = 0
        kept = []
        for recorded in movement().events:  # a rest follows its sweep and carries no number
            current = recorded.event.sweep.index if isinstance(recorded.event, SweepStarted) else current
            kept.extend([recorded] if current in sweeps else [])
        return replace(movement(), events=tuple(kept))

    before = verified().before
    assert before is not None
    parts = observe_runs([part(range(2)), part(range(0)), part(range(2, 6))])
    resumed = verify("gyro", KNOWN, seen_after(), parts, calibrated_gyro())
    assert resumed.before is not None
    assert len(resumed.before.delay_s) == 2
    assert resumed.before.movement.samples == before.movement.samples
    np.testing.assert_allclose(resumed.before.movement.rms_rad_s, before.movement.rms_rad_s)
    np.testing.assert_allclose(resumed.rotation.matrix, verified().rotation.matrix, atol=1e-6)


def reference_asleep_in_rests(run: RunData) -> RunData:
    board_s = run.samples["reference"]["board_time_us"] * 1e-6
    asleep = np.zeros(len(board_s), dtype=bool)
    for rest in iterate_rests(run):
        since = board_s * (1 + QUIET.drift) + 33.0 - rest.start_s
        asleep |= (since > 0.3) & (since < 2.7)
    return replace(run, samples={**run.samples, "reference": run.samples["reference"][~asleep]})


def reference_of_another_board(run: RunData) -> RunData:
    samples = run.samples["reference"].copy()
    samples["board_time_us"] += 5_000_000
    return replace(run, samples={**run.samples, "reference": samples})


def one_wrist(run: RunData) -> RunData:
    return replace(run, events=run.events[:8])


REFUSALS: dict[str, tuple[str, Callable[[RunData], RunData]]] = {
    "raw readings": ("wrong_mode", lambda run: movement()),
    "a calibrated reference": (
        "wrong_mode",
        lambda run: replace(
            run, sensors={**run.sensors, "reference": replace(run.sensors["reference"], mode="calibrated")}
        ),
    ),
    "no reference": ("sensor_missing", lambda run: replace(run, sensors={"gyro": run.sensors["gyro"]})),
    "nothing finished": ("nothing_to_compare", lambda run: replace(run, events=run.events[:1])),
    "a silent reference": ("no_overlap", reference_asleep_in_rests),
    "another board": ("different_clocks", reference_of_another_board),
    "one wrist": ("incomplete_verification", one_wrist),
}


@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", REFUSALS)
def test_recordings_that_cannot_be_compared_are_refused_by_name(name: str) -> None:
    error, spoil = REFUSALS[name]
    with pytest.raises(Fault, match=error):
        verify("gyro", KNOWN, observe_runs([spoil(repetition())]))


def test_one_wrist_does_not_tell_how_the_sensors_sit() -> None:
    with pytest.raises(Fault, match="rank_deficient"):
        verify("gyro", KNOWN, seen_after(), observe_runs([one_wrist(movement())]), TRUTH)


def test_the_calibration_s_recording_must_be_raw() -> None:
    with pytest.raises(Fault, match="wrong_mode"):
        verify("gyro", KNOWN, seen_after(), seen_after(), calibrated_gyro())


def limits(rms: float | None, mean: float | None) -> Limits:
    return Limits(
        scale_deviation=1,
        scale_std=1,
        bias_rad_s=1,
        bias_std_rad_s=1,
        condition=1,
        verification_rms_rad_s=rms,
        verification_mean_rad_s=mean,
    )


def test_the_worst_axis_and_the_worst_revolution_are_judged() -> None:
    def judged(found: Verification | None, of: Limits) -> str:
        return verdict(verification_checks("gyro", found, of))

    after = verified().after
    rms = float(after.movement.rms_rad_s.max())
    mean = max(float(np.abs(turn.error_rad_s).max()) for turn in after.revolutions)
    assert judged(verified(), limits(1.01 * rms, 1.01 * mean)) == "pass"
    assert judged(verified(), limits(0.99 * rms, 1.01 * mean)) == "fail"
    assert judged(verified(), limits(1.01 * rms, 0.99 * mean)) == "fail"
    assert judged(verified(), limits(None, 1.0)) == "fail"
    assert judged(None, limits(1.0, 1.0)) == "fail"


@pytest.mark.parametrize(
    ("scale", "bias_rad_s", "error_rad_s"),
    [(1.0, 0.0, 0.0), (1.02, 0.0, 0.02 * TURN_RATE), (1.0, 0.015, 0.015)],
    ids=["right", "scale off", "bias off"],
)
def test_a_reference_that_misses_the_arm_is_blamed_itself(scale: float, bias_rad_s: float, error_rad_s: float) -> None:
    """A turntable's values mistyped, or a reference that has aged: the sensor differs from it, but not from the arm."""
    reference = Reference("reference", KNOWN.scale * scale, KNOWN.bias_rad_s + np.array([bias_rad_s, 0.0, 0.0]))
    found = verify("gyro", reference, seen_after(), seen_before(), calibrated_gyro())
    assert found.reference_error_rad_s == pytest.approx(error_rad_s, abs=5e-4)
    checks = {check.name: check.passed for check in verification_checks("gyro", found, limits(1.0, 0.01))}
    assert checks["gyro.verification_reference"] == (error_rad_s < 0.01)


def test_the_result_names_its_statistics_and_a_person_can_read_them() -> None:
    entry = verification_entry(verified())
    assert entry.before is not None
    for seen in (entry.before, entry.after):
        np.testing.assert_allclose(np.square(seen.movement.rms_rad_s), seen.movement.mse_rad2_s2)
    console = Console(width=120, record=True)
    console.print(verification_table("gyro", entry), *verification_lines(entry))
    shown = console.export_text()
    assert f"{entry.before.movement.rms_rad_s[0]:.4f}" in shown
    delay = re.search(r"delay\s+behind the reference: ([\d.]+) ms \(± ([\d.]+)\)", shown)
    assert delay and float(delay[1]) == pytest.approx(4.0, abs=0.06)
    assert float(delay[2]) == pytest.approx(2e3 * entry.after.delay_std_s[0], abs=0.006)
    turned = re.search(r"to the reference: [-+. \d]+° \(± ([\d.]+)\)", shown)
    assert turned and float(turned[1]) == pytest.approx(2 * np.degrees(max(entry.rotation.std_rad)), abs=6e-4)
    alone = verification_entry(replace(verified(), before=None, after=replace(verified().after, noise_rad_s=None)))
    console.print(verification_table("gyro", alone))
    assert "–" in console.export_text()


@pytest.mark.thorough
def test_plots_of_before_and_after_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = Plotted(("verification_gyro_before", "verification_gyro_after"))
    assert draw_verifications([verified()], tmp_path) == (written,)
    for when in ("before", "after"):
        name = f"verification_gyro_{when}"
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (tmp_path / f"{name}.svg").stat().st_size < 500_000
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    (told,) = draw_verifications([verified()], tmp_path)
    assert install_command("study") in str(line(told))
