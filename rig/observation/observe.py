"""Averaged revolutions of a recording, the input of the estimators.

An observation is the mean reading over exactly one turn of a joint, or over an arc. Over a whole turn in the time T the
mean speed is 2π/T regardless of the servo's vibration; over an arc it is Δθ/T, with the angle Δθ between the encoders'
readings at its ends. The same weights average the readings and the arm's rate, so a vibration that the encoders measure
adds no noise.

Whatever does not belong in a calibration raises a Fault with a name of its own.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.arrays import Array, median
from rig.estimation.refusals import check_reading_ratio
from rig.motion.steps import Sweep
from rig.observation.arm_rests import add_attitude, average_rests, estimate_bias_drift
from rig.observation.average import Average, Stream, build_average, slice_time, synchronize_stream
from rig.observation.clocks.time_base import TimeBase
from rig.observation.lost_samples import lost_samples
from rig.observation.motion.arm_motion import ArmMotion, is_sparse
from rig.observation.motion.revolution import Revolution, arm_states_lost, describe
from rig.observation.reference.dwell_acceleration import DwellReading, dwell_readings
from rig.observation.reference.swept_acceleration import SweptAcceleration, swept_acceleration
from rig.observation.statistics.spectral_lines import SIDEBANDS, harmonics
from rig.observation.stuck_check import check_dwells, check_other_direction, check_rests
from rig.observation.turn_mean import SampledTurn, turn_mean
from rig.observation.windows import FinishedSweep, Window, swept

MIN_SINGULAR_RATIO = 0.05  # to the design's norm, for which a response is fitted
STUCK_REPEATS = 10  # equal readings in a row of a sensor whose noise exceeds one count
MAX_ERROR_RATIO = 0.5  # to a sweep's rate: an axis with equal readings is stuck if its error is larger
MISREADING_FAULTS = {"wrong_axis", "wrong_sign", "wrong_unit"}  # a stuck sensor causes these faults too


@dataclass(frozen=True, slots=True)
class Observation:
    """One revolution, or one arc of a joint, averaged.

    - sweep: index of the sweep in the plan; in external data the number, from 1, of the row.
    - joint_name: the joint that turned; direction: the direction of its turn. Both are None in external data.
    - axis ("x", "y", "z"), sign: the sensor axis that is nominally along the turn.
    - axis_flange (3,): direction, in the flange's frame, of the arm's mean rate, which is weighted like the mean
      reading; speed_rad_s: the size of this rate.
    - speed_std_rad_s: standard deviation of the speed, because the turn's ends lie between the arm's states.
    - lost: number of samples missing from the average.
    - axis_errors (13, 3): change of the axis per radian of each of the arm's errors
      (`rig.motion.geometry.AXIS_ERRORS`).
    - arm_m (3,): vector from the joint's axis to the flange's origin, in the flange's frame.
    - acceleration: the accelerometer's readings in the same turn, if one is to be calibrated.
    - angle_rad: the angle turned, None in external data; arc_rad: the joint's angles at an arc's ends, the lower first,
      None for whole turns.
    - ripple: RMS unevenness of the turn, relative to its rate; sidebands: number on either side of a spectral line.
    - state_gain: the noise that the arm's states cause in the weighted mean rate, relative to that in the plain mean.
    """

    sweep: int
    joint_name: str | None
    direction: str | None
    axis: str
    sign: int
    axis_flange: Array
    speed_rad_s: float
    speed_std_rad_s: float
    lost: int
    average: Average
    axis_errors: Array | None = None
    arm_m: Array | None = None
    acceleration: SweptAcceleration | None = None
    angle_rad: float | None = None
    arc_rad: tuple[float, float] | None = None
    ripple: float = 0.0
    sidebands: int = SIDEBANDS
    state_gain: float = 1.0


@dataclass(frozen=True, slots=True)
class SensorObservations:
    """The observations of one sensor: its clock, its revolutions and its rests (mean readings at zero rate).

    `dwells` are the averages of the sensor's accelerations in attitudes, if accelerations were recorded.
    """

    time_base: TimeBase
    revolutions: tuple[Observation, ...]
    rests: tuple[Average, ...]
    dwells: tuple[DwellReading, ...] = ()


def observe_sensor(
    run: RunData, sensor: str, motion: ArmMotion, settings: ObservationThresholds, superseded: Collection[int] = ()
) -> SensorObservations:
    """Return the observations of a recording's finished sweeps and of its rests; `motion` is the arm's motion.

    Interrupted sweeps are left out, as are sweeps and dwells in `superseded`, which a later recording of the run
    repeats, and the rests next to them. Raise Fault `incomplete_revolution`, `arm_states_lost`, `speed_slider`,
    `speed_not_constant`, `other_joint_moved`, `lost_samples`, `saturation`, `stuck_sensor`, `stuck_axis`, `wrong_axis`,
    `wrong_sign`, `wrong_unit`, `not_finite`, `time_base_not_found`, `board_clock_restarted`, `duplicated_samples`,
    `impossible_times`, and what `dwell_readings` raises.
    """
    stream = synchronize_stream(run.samples[sensor], run.sensors[sensor], motion)
    revolutions = list[Observation]()
    for finished in swept(run):
        if finished.sweep.index in superseded:
            continue
        try:
            revolutions.append(_observe_revolution(run, stream, motion, finished, settings))
        except Fault as fault:
            if fault.name in MISREADING_FAULTS:
                rests = average_rests(run, stream, motion, fit_response(stream, revolutions), superseded)
                check_response(run, rests, ())
                check_other_direction(finished.sweep, [turn.joint_name for turn in revolutions], fault)
            raise
    rests = average_rests(run, stream, motion, fit_response(stream, revolutions), superseded)
    has_accelerometer = stream.sensor.measures(ACCELERATION)
    dwells = tuple(dwell_readings(run, stream, motion, settings, superseded)) if has_accelerometer else ()
    check_response(run, rests, dwells)
    drift = estimate_bias_drift(rests)
    return SensorObservations(
        stream.clock,
        tuple(replace(turn, average=_add_drift(turn.average, drift)) for turn in revolutions),
        tuple(_add_drift(rest, drift) for rest in rests),
        dwells,
    )


def observe_each_sweep(
    run: RunData, stream: Stream, motion: ArmMotion, settings: ObservationThresholds
) -> Attempts[int, Observation]:
    """Return the observations of finished sweeps, and the faults of sweeps without one, both by the sweep's index.

    A fault of one sweep does not affect the others.
    """
    observe = partial(_observe_revolution, run, stream, motion, settings=settings)
    return attempt_each({finished.sweep.index: partial(observe, finished) for finished in swept(run)})


def nearest_axis(vector: Array) -> tuple[str, int]:
    """Return the axis, "x", "y" or "z", nearest to a direction (3,), and the direction's sign (1, −1) along it."""
    nearest = int(np.argmax(np.abs(vector)))
    return "xyz"[nearest], 1 if vector[nearest] > 0 else -1


def check_response(run: RunData, rests: Sequence[Average], dwells: Sequence[DwellReading]) -> None:
    """Raise Fault `stuck_sensor` or `stuck_axis` if a sensor's readings do not follow the arm's motion."""
    speeds = [finished.sweep.speed_rad_s for finished in swept(run)]
    if speeds:
        check_rests(rests, min(speeds))
    check_dwells(dwells, run.settings.site)


def _observe_revolution(
    run: RunData, stream: Stream, motion: ArmMotion, finished: FinishedSweep, settings: ObservationThresholds
) -> Observation:
    turn = motion.turn(finished.sweep, finished.window, settings)
    observation = _average_revolution(stream, motion, finished.sweep, turn, settings)
    if stream.sensor.measures(ACCELERATION) and run.settings.planned_dwells:
        acceleration = swept_acceleration(stream, motion, finished.sweep, turn, run.settings)
        return replace(observation, acceleration=acceleration)
    return observation


def fit_response(stream: Stream, turns: Sequence[Observation]) -> Array:
    """Return the response (3, 3) of readings to the flange's rates, by least squares over the turns.

    Return the nominal mounting if the turns do not cover all axes.
    """
    design = np.array([(*(turn.speed_rad_s * turn.axis_flange), 1.0) for turn in turns]).reshape(-1, 4)
    if np.linalg.matrix_rank(design, tol=MIN_SINGULAR_RATIO * np.linalg.norm(design)) < 4:
        return np.array(stream.sensor.mounting)
    coefficients, *_ = np.linalg.lstsq(design, np.array([turn.average.mean_rad_s for turn in turns]), rcond=None)
    return np.asarray(coefficients[:3].T, dtype=np.float64)


def _add_drift(average: Average, drift: Array) -> Average:
    return replace(average, variance_rad2_s2=average.variance_rad2_s2 + drift, drift_rad2_s2=drift)


def _average_revolution(
    stream: Stream, motion: ArmMotion, sweep: Sweep, turn: Revolution, settings: ObservationThresholds
) -> Observation:
    """Return the observation of a revolution. Raise Fault if its samples or the arm's states are unusable."""
    where = describe(sweep)
    inside = slice_time(stream, turn.start_s, turn.end_s)
    lost = _count_lost(stream, inside, where, settings)
    _check_saturation(stream, inside, where)
    _check_stuck(stream, inside, where)
    covered = motion.covered(stream.time_s[inside])
    if covered.mean() < 0.5:
        raise arm_states_lost(where, "more than half the time")
    sampled = _sample_turn(stream.time_s[inside], motion, turn, covered)
    readings = stream.readings_rad_s[inside][covered]
    mean, weights = turn_mean(readings, stream.steps, sampled)
    average = add_attitude(build_average(stream, inside, Window(turn.start_s, turn.end_s), mean), motion)
    expected = np.array(stream.sensor.mounting) @ turn.axis_flange
    rate_read = average.mean_rad_s - stream.clock.zero_rate_rad_s
    _check_frozen(readings, rate_read, turn.speed_rad_s * expected, where)
    _check_direction(rate_read, expected, where, settings)
    check_reading_ratio(float(np.linalg.norm(rate_read)) / turn.speed_rad_s, where)
    axis, sign = nearest_axis(expected)
    rate = turn.speed_rad_s * turn.axis_flange if turn.uneven else weights @ sampled.rates_rad_s
    speed_rad_s = float(np.linalg.norm(rate))
    return Observation(
        sweep=sweep.index,
        joint_name=sweep.joint_name,
        direction=sweep.direction,
        axis=axis,
        sign=sign,
        axis_flange=rate / speed_rad_s,
        speed_rad_s=speed_rad_s,
        speed_std_rad_s=turn.speed_std_rad_s,
        lost=lost,
        average=average,
        axis_errors=turn.axis_errors,
        arm_m=turn.arm_m,
        angle_rad=turn.angle_rad,
        arc_rad=None if turn.closed else sweep.revolution_rad,
        ripple=float(sampled.uneven_rad_s.std()) / turn.speed_rad_s,
        sidebands=turn.sidebands,
        state_gain=1.0 if turn.uneven else motion.state_gain(stream.time_s[inside][covered], weights),
    )


def _sample_turn(time_s: Array, motion: ArmMotion, turn: Revolution, covered: NDArray[np.bool_]) -> SampledTurn:
    """Return a turn at those of the times (n,) that the mask `covered` marks, because the arm's motion is recorded."""
    fraction = (time_s - turn.start_s) / turn.duration_s
    waves = harmonics(turn.angle_rad * fraction, 2 * turn.sidebands)[covered]
    if not turn.closed:
        waves -= waves.mean(axis=0)  # over an arc, gravity's part remains in the mean; the attitudes account for it
    rates = motion.rates_at_samples(time_s)[covered]
    return SampledTurn(
        fraction=fraction[covered],
        rates_rad_s=rates,
        uneven_rad_s=rates @ turn.axis_flange - turn.speed_rad_s,
        regressors=waves,
        sidebands=turn.sidebands,
        encoders_true=not turn.uneven,
        closed=turn.closed,
        complete=bool(covered.all()) and not is_sparse(time_s),
    )


def _count_lost(stream: Stream, inside: slice, where: str, settings: ObservationThresholds) -> int:
    """Return the number of missing samples: lost on the link (by sequence number), or missed by the board (by time).

    Raise Fault `lost_samples` if there are too many.
    """
    around = slice(max(inside.start - 1, 0), inside.stop + 1)
    steps = np.diff(stream.raw["sequence"][around])  # modulo 2³², like the board's counter
    intervals = np.diff(stream.board_time_s[around])
    covered = inside.start > 0 and inside.stop < len(stream.raw) and len(steps) > 1
    by_sequence = int(steps.astype(np.int64).sum()) - len(steps)
    by_time = int(np.sum(np.round(intervals / median(intervals)) - 1)) if covered else 0
    lost = max(by_sequence, by_time)
    got = inside.stop - inside.start
    if not covered or lost > settings.max_lost_fraction * (got + lost):
        what = f"{lost} of {got + lost} samples are missing" if covered else "the samples do not cover the revolution"
        what += f", {100 * settings.max_lost_fraction:g} % may be missing"
        raise lost_samples(stream.sensor, stream.raw[inside], where, what, "repeat the sweep")
    return lost


def _check_saturation(stream: Stream, inside: slice, where: str) -> None:
    saturated = stream.sensor.channel(RATE).is_saturated(stream.raw[inside])
    if saturated.any():
        raise Fault(
            "saturation",
            f"in {where} {int(saturated.sum())} samples are at the end of the sensor's range",
            "Choose a wider range or a slower sweep",
        )


def _check_stuck(stream: Stream, inside: slice, where: str) -> None:
    """Raise Fault `stuck_sensor` if all axes repeat one reading for long, although the noise is at least one count."""
    channel = stream.sensor.channel(RATE)
    changes = np.flatnonzero(np.any(np.diff(channel.counts(stream.raw[inside]), axis=0), axis=1))
    longest = int(np.max(np.diff(changes, prepend=-1, append=inside.stop - inside.start - 1)))
    if longest <= STUCK_REPEATS:
        return
    if median(np.abs(np.diff(channel.counts(stream.raw), axis=0)), axis=0).min() >= 1:
        raise Fault(
            "stuck_sensor",
            f"in {where} the gyroscope repeats one reading {longest} times",
            "Check the sensor's supply and its bus wiring, then repeat the sweep",
        )


def _check_frozen(readings: Array, rate_read: Array, expected_rad_s: Array, where: str) -> None:
    """Raise Fault `stuck_axis` if all readings of an axis are equal and differ from its expected rate.

    Equal readings due to coarse resolution alone do not raise the Fault, because they are close to the expected rate.
    """
    still = np.ptp(readings, axis=0) == 0
    misread = np.abs(rate_read - expected_rad_s) > MAX_ERROR_RATIO * np.linalg.norm(expected_rad_s)
    for axis in np.flatnonzero(still & misread):
        raise Fault(
            "stuck_axis",
            f"in {where} the {'xyz'[axis]} axis of the gyroscope repeats {readings[0, axis]:.4g} rad/s, and turns at "
            f"{expected_rad_s[axis]:.4g} rad/s",
            "Check the sensor and its supply; if it stays, replace the sensor",
        )


def _check_direction(rate_read: Array, expected: Array, where: str, settings: ObservationThresholds) -> None:
    """Raise Fault `wrong_sign` or `wrong_axis` if the reading without bias is not along `expected` (3,)."""
    cosine = float(rate_read @ expected / (np.linalg.norm(rate_read) * np.linalg.norm(expected)))
    angle = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    limit = settings.max_axis_deviation_deg
    if angle <= limit:
        return
    opposite = angle >= 180 - limit
    what = "opposite to the turn" if opposite else f"{angle:.0f}° away from the turn; {limit:g}° is allowed"
    raise Fault(
        "wrong_sign" if opposite else "wrong_axis",
        f"in {where} the gyroscope reads {what}",
        "Correct the sensor's mounting in the configuration, or how it is fixed to the flange",
    )
