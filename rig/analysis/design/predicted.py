"""The uncertainty that a plan will reach, before it is run: what a recording of it would tell, and its budget. Pure.

A plan says when each joint is where, the configuration says what is known of turner, site and sensor, the data sheet
says how the sensor scatters. That is all the budget of a run is made of, but for two things: how the bias wandered
beside its flicker, and how far it warmed, which readings alone tell.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rig.analysis.clock import BY_COMPUTER, BY_CRYSTAL, PPM, ClockCheck, ClockComparison
from rig.analysis.design.planned_motion import (
    STANDING_S,
    PlannedRun,
    Timed,
    measured,
    planned_attitude,
    planned_run,
    planned_turn,
    timed_of,
)
from rig.analysis.gyroscope.calibration import solve_six_observation
from rig.analysis.gyroscope.vector_inputs import Part, known_sensor, put_together, unknown_of
from rig.analysis.surroundings import Surroundings
from rig.config.models import RigConfig
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.stage_section import rotation_by
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget, budget
from rig.estimation.gyroscope.six_observation_budget import six_observation_budget
from rig.estimation.gyroscope.vector_fit import Seen, explain
from rig.estimation.statistics.bias_process import BiasProcess
from rig.motion.state import Made
from rig.motion.steps import TURN_RAD, Plan, Step, Sweep
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST, REST_SETTLING_S
from rig.observation.average import Average
from rig.observation.motion.even_turn import GUARD_RAD
from rig.observation.observe import Observation, nearest_axis

ROOM_C = 22.0  # at one temperature all the time: what a run warms is not known beforehand
STEP_K = 1 / 16  # of a thermometer, assumed
REMOUNTING_S = 60.0  # between two stages, assumed
# How far off its nominal mounting a sensor sits, in all, where no `uncertainty.mount_deg` says it of an item that is
# mounted anew; assumed. The farther it does, the more do the axes of arm and sensor matter.
SITS_OFF_DEG = 5.0
ASKING_STD_S = 0.9e-3  # of the moment of a reading within the 3 ms that asking a servo takes
STATE_JITTER_S = 2e-6  # of an arm's states, as runs with controllers of real time find it


def predicted(config: RigConfig, plan: Plan, made: Made) -> dict[str, Budget]:
    """The budget that a run of the plan will have, for each sensor to calibrate.

    It is that of the solution which the turner's runs are judged by: of the speeds alone where single readings of its
    angle scatter.
    Raises Fault as the estimators do where the plan does not tell enough, Refused as `settings_of`.
    """
    run = planned_run(config, plan, made.kinematics)
    return {name: _budget(config, run, made, name, sensor) for name, sensor in config.to_calibrate.items()}


def _budget(config: RigConfig, run: PlannedRun, made: Made, name: str, sensor: SensorSection) -> Budget:
    known, mounting = run.known, mounting_matrix(sensor.mounting)
    scatters = made.reading_std_rad > 0
    jitter_s = 0.0 if scatters else STATE_JITTER_S  # what scatters tells no jitter beside
    surroundings = Surroundings(
        run.site, known, _clock(known, on_board=sensor.on_board), jitter_s, run.settings.extension_m
    )
    parts = [_part(config, each, sensor, made) for each in _stages(run)]
    seen = put_together(parts, surroundings)
    stays = known_sensor(
        known, name, float(np.radians(sensor.range_deg_s)), np.full(len(seen.windows_s), ROOM_C), STEP_K
    )
    off_deg = SITS_OFF_DEG if seen.mount_turns_rad is None else known.mount_deg
    seen = replace(seen, means_rad_s=_read(seen, _sitting_off(off_deg) @ mounting), sensor=stays)
    explained = explain(seen, mounting, BiasProcess(0.0, 0.0, 0, stays.instability_rad_s))
    unknown = unknown_of(surroundings, name, None)
    if not scatters:
        return budget(explained, unknown)
    turns = [turn for part in parts for turn in part.turns]
    read = [
        replace(turn, average=replace(turn.average, mean_rad_s=mean))
        for turn, mean in zip(turns, seen.means_rad_s, strict=False)  # the rests come after them
    ]
    axes_rad = float(np.radians(known.of("non_orthogonality_deg", name)))
    return six_observation_budget(explained, solve_six_observation(read, "newton"), unknown, axes_rad)


def _sitting_off(angle_deg: float) -> Array:
    """(3, 3) a rotation by that angle about an axis that is as far from x as from y and z."""
    return rotation_by(np.radians(angle_deg) / np.sqrt(3) * np.array([1.0, -1.0, 1.0]))


def _read(seen: Seen, matrix: Array) -> Array:
    """(N, 3) what a sensor of that F (3, 3) reads, with the same noise each time: no two readings are quite alike."""
    noise = np.random.default_rng(len(seen.windows_s)).standard_normal((len(seen.windows_s), 3))
    read: Array = seen.rates_rad_s @ matrix.T + np.sqrt(seen.variances_rad2_s2) * noise
    return read


def _clock(known: Uncertainty, *, on_board: bool) -> ClockCheck:
    """The controller's clock as a run will hold it against this computer's and the board's crystal."""
    stated = {BY_COMPUTER: known.computer_clock_ppm, **({BY_CRYSTAL: known.crystal_ppm} if on_board else {})}
    compared = tuple(ClockComparison(by, 0.0, ppm * PPM, 0.0) for by, ppm in stated.items())
    half_width = known.controller_clock_ppm * PPM
    weights = 3 / half_width**2 + sum(1 / each.std**2 for each in compared)
    return ClockCheck(0.0, float(weights**-0.5), compared, half_width)


def _stages(run: PlannedRun) -> Iterator[PlannedRun]:
    """The recordings of a run, one of each stage of its plan; the run itself of a plan without."""
    begins, since_s = [stage.begins for stage in run.plan.stages] or [0], 0.0
    for number, (first, last) in enumerate(zip(begins, [*begins[1:], len(run.plan.steps)], strict=True)):
        own = replace(run.plan, steps=run.plan.steps[first:last], stages=())
        yield replace(run, plan=own, settings=replace(run.settings, stage=number), since_s=since_s)
        since_s += own.duration_s + 2 * STANDING_S + REMOUNTING_S


def _part(config: RigConfig, run: PlannedRun, sensor: SensorSection, made: Made) -> Part:
    """What a recording would tell."""
    turns = [_turn(each, run, sensor, _scatter(config, each.step, made)) for each in timed_of(run.plan, Sweep)]
    still = [
        replace(each, start_s=each.start_s + REST_SETTLING_S, end_s=each.end_s - REST_SETTLING_S)
        for each in measured(run.plan)
        if not isinstance(each.step, Sweep)
    ]
    told = [each for each in still if (each.end_s - each.start_s) * sensor.rate_hz >= MIN_SAMPLES_AT_REST]
    rests = [_average(each, run, sensor) for each in told]
    return Part(turns, rests, run.since_s, run.settings.stage, np.array(run.settings.mount))


def _average(at: Timed[Step], run: PlannedRun, sensor: SensorSection) -> Average:
    start_s, end_s = at.window_s
    lasting_s, walk_rad_sqrt_s = end_s - start_s, PARTS[sensor.part].angle_random_walk_rad_sqrt_s
    samples = max(round(lasting_s * sensor.rate_hz), 2)
    return Average(
        mean_rad_s=np.zeros(3),
        variance_rad2_s2=np.full(3, walk_rad_sqrt_s**2 / lasting_s),
        noise_rad_s=np.full(3, walk_rad_sqrt_s * sensor.rate_hz**0.5),
        samples=samples,
        start_s=start_s,
        end_s=end_s,
        temperature_c=ROOM_C,
        attitude=planned_attitude(at, run.arm, np.array(run.settings.mount)),
        freedom=float(samples - 1),
    )


def _turn(at: Timed[Sweep], run: PlannedRun, sensor: SensorSection, speed_std: float) -> Observation:
    sweep, turn = at.step, planned_turn(at, run.arm, np.array(run.settings.mount))
    axis, sign = nearest_axis(mounting_matrix(sensor.mounting) @ turn.axis_flange)
    return Observation(
        sweep=sweep.index,
        joint_name=sweep.joint_name,
        direction=sweep.direction,
        axis=axis,
        sign=sign,
        axis_flange=turn.axis_flange,
        speed_rad_s=sweep.speed_rad_s,
        speed_std_rad_s=speed_std * sweep.speed_rad_s,
        lost=0,
        average=_average(at, run, sensor),
        axis_errors=turn.axis_errors,
        arm_m=turn.arm_m,
        angle_rad=turn.angle_rad,
        arc_rad=None if turn.closed else sweep.revolution_rad,
    )


def _scatter(config: RigConfig, sweep: Sweep, made: Made) -> float:
    """Standard deviation of the mean speed, as a share of it, of a shaft whose single readings scatter.

    The places that come again a turn later are so many pairs of readings; see `rig.observation.motion.turn_speed`.
    """
    if not made.reading_std_rad or not isinstance(config.turner, ServoSection):
        return 0.0
    ramp_rad = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2) + GUARD_RAD
    whole_rad = abs(sweep.end_q_rad[sweep.joint] - sweep.start_q_rad[sweep.joint])
    places = (whole_rad - 2 * ramp_rad - TURN_RAD) / sweep.speed_rad_s * config.turner.state_rate_hz
    scatter_rad = np.hypot(made.reading_std_rad, ASKING_STD_S * sweep.speed_rad_s)
    return float(scatter_rad * np.sqrt(2 / max(places, 1.0)) / TURN_RAD)
