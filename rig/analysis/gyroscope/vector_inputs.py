"""The inputs of the vector model and its budget, from recordings and their environment."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rig.analysis.clock_comparison import PPM
from rig.analysis.environment import MeasurementEnvironment
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import UnknownErrors
from rig.estimation.gyroscope.earth_rate import EarthRate, EarthRatePrior
from rig.estimation.gyroscope.own_errors import SensorProperties
from rig.estimation.gyroscope.vector_fit import VectorInputs
from rig.motion.geometry import AXIS_ERRORS
from rig.observation.average import Average
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import dof_by_axis

ZERO_INDICES = tuple(index for index, name in enumerate(AXIS_ERRORS) if name.startswith("zero"))
SAME_AXIS_COSINE = 1 - 1e-6  # the other joints return to 1.4 mrad
WAVE_RATIO = 0.3  # of an encoder's error once or twice a revolution to the error of the joint's zero; assumed


@dataclass(frozen=True, slots=True)
class RecordingPart:
    """A sensor's revolutions and rests in one recording.

    The recording's clock begins `clock_offset_s` after that of the first recording. The item was remounted for each
    `stage`; `mount` (3, 3) transforms the flange's frame into the item's, None if they agree.
    """

    turns: Sequence[Observation]
    rests: Sequence[Average]
    clock_offset_s: float
    stage: int
    mount: Array | None


def collect_inputs(recordings: Sequence[ObservedRun], sensor: str, environment: MeasurementEnvironment) -> VectorInputs:
    """Return a sensor's mean readings in all sweeps and rests of a run, with the arm's motion in each.

    Speeds are corrected for the error of the controller's clock: if it runs too fast, recorded speeds are too small.
    """
    run = recordings[0].run
    parts = [
        RecordingPart(
            recording.sensors[sensor].revolutions,
            recording.sensors[sensor].rests,
            recording.clock_offset_s,
            recording.run.settings.stage,
            recording.motion.mount,
        )
        for recording in recordings
    ]
    described = _describe_recorded(environment, sensor, run.sensors[sensor], _list_averages(parts)[0])
    return replace(combine_recordings(parts, environment), sensor=described)


def combine_recordings(parts: Sequence[RecordingPart], environment: MeasurementEnvironment) -> VectorInputs:
    """Return the inputs from all recordings, first revolutions, then rests, without the sensor's properties."""
    site, extension_m = environment.site, np.array(environment.extension_m)
    turns = [turn for part in parts for turn in part.turns]
    averages, offsets_s = _list_averages(parts)
    rests = len(averages) - len(turns)
    attitudes = np.array([average.attitude for average in averages], dtype=np.float64)
    rates_rad_s = np.array([turn.speed_rad_s * turn.axis_flange for turn in turns])
    lever_arms = np.concatenate([lever_arms_m(part.turns, extension_m, part.mount) for part in parts])
    stages = [part.stage for part in parts for _ in part.turns]
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    return VectorInputs(
        means_rad_s=np.array([average.mean_rad_s for average in averages]),
        variances_rad2_s2=np.array([average.variance_rad2_s2 - average.drift_rad2_s2 for average in averages]),
        turns_rad_s=np.concatenate([rates_rad_s * (1 + environment.clock.error), np.zeros((rests, 3))]),
        earth_rate_rad_s=earth,
        speed_std_rad_s=np.array([*(turn.speed_std_rad_s for turn in turns), *np.zeros(rests)]),
        attitudes=attitudes,
        gravity_m_s2=attitudes @ site.down_m_s2,
        windows_s=np.array([(average.start_s, average.end_s) for average in averages]) + offsets_s[:, None],
        joints=(*(turn.joint_name for turn in turns), *[None] * rests),
        axis_errors_rad_s=_axis_errors(turns, rests, environment.uncertainty.axis_deg),
        return_errors_rad_s=_return_errors(turns, rests, environment.uncertainty),
        encoder_errors_rad_s=_encoder_errors(turns, rests, environment.uncertainty),
        mount_turns_rad=list_mount_rotations(stages, rests, environment.uncertainty.mount_deg),
        arms_m=np.concatenate([lever_arms, np.zeros((rests, 3))]),
        noise_dof=dof_by_axis(average.dof for average in averages),
        ripples=np.array([*(turn.ripple for turn in turns), *np.zeros(rests)]),
        state_gains=np.array([*(turn.state_gain for turn in turns), *np.ones(rests)]),
        roundings_rad_s=np.sqrt(dof_by_axis(average.rounding_rad2_s2 for average in averages)),
    )


def _list_averages(parts: Sequence[RecordingPart]) -> tuple[list[Average], Array]:
    """Return the N averages of all parts, first revolutions, then rests, and the clock offset of each in s (N,)."""
    averages = [turn.average for part in parts for turn in part.turns]
    averages += [rest for part in parts for rest in part.rests]
    counts = [*(len(part.turns) for part in parts), *(len(part.rests) for part in parts)]
    return averages, np.repeat(2 * [part.clock_offset_s for part in parts], counts)


def _describe_recorded(
    environment: MeasurementEnvironment, name: str, sensor: RecordedSensor, averages: Sequence[Average]
) -> SensorProperties:
    temperature_c = np.array([average.temperature_c for average in averages])
    stated = describe_sensor(environment.uncertainty, name, sensor.range_rad_s, temperature_c, sensor.unseen_change_k)
    return replace(stated, temperature_words=sensor.temperature_words)


def describe_sensor(
    uncertainty: Uncertainty, name: str, full_scale_rad_s: float, temperature_c: Array, temperature_step_k: float
) -> SensorProperties:
    """Return the stated properties of the sensor `name`, with its range and its temperature in each average (N,)."""
    return SensorProperties(
        nonlinearity=uncertainty.find_stated_size("nonlinearity_percent", name) / 100,
        full_scale_rad_s=full_scale_rad_s,
        bias_rad_s_per_k=float(np.radians(uncertainty.find_stated_size("bias_deg_s_k", name))),
        scale_per_k=PPM * uncertainty.find_stated_size("scale_ppm_k", name),
        instability_rad_s=float(np.radians(uncertainty.find_stated_size("bias_instability_deg_h", name) / 3600)),
        temperature_c=temperature_c,
        temperature_step_k=temperature_step_k,
    )


def lever_arms_m(turns: Sequence[Observation], extension_m: Array, mount: Array | None = None) -> Array:
    """Return the lever arms (M, 3) from the axis of rotation to the sensors in M sweeps, in the item's frame.

    They are zero if no robot turned the item. `extension_m` (3,): from the flange to the sensors, in the flange's
    frame. `mount` (3, 3): rotation from the flange's frame to the item's; None if they agree.
    """
    mounted_m = extension_m if mount is None else mount @ extension_m
    lever_arms = [turn.arm_m + mounted_m if turn.arm_m is not None else np.zeros(3) for turn in turns]
    return np.reshape(lever_arms, (-1, 3))


def _axis_errors(turns: Sequence[Observation], rests: int, axis_deg: float) -> Array:
    """Return `VectorInputs.axis_errors_rad_s` (P, N, 3), for errors of the arm's angles of half-width `axis_deg`."""
    steady = np.array([name.startswith(("twist", "zero")) for name in AXIS_ERRORS])
    std = np.radians(axis_deg) / np.sqrt(3) * np.where(steady, 1.0, WAVE_RATIO)
    errors = [std[:, None] * turn.speed_rad_s * turn.axis_errors for turn in turns if turn.axis_errors is not None]
    return np.concatenate([np.swapaxes(errors, 0, 1), np.zeros((len(std), rests, 3))], axis=1)


def _return_errors(turns: Sequence[Observation], rests: int, uncertainty: Uncertainty) -> Array:
    """Return `VectorInputs.return_errors_rad_s` (P, N, 3), due to joints that return imperfectly to an angle.

    Each group of consecutive sweeps about one axis has its own errors.
    """
    errors = np.array([turn.speed_rad_s * turn.axis_errors for turn in turns if turn.axis_errors is not None])
    tilts = uncertainty.repeatability_std_rad * np.swapaxes(errors[:, ZERO_INDICES], 0, 1)
    visits = np.array([np.isin(np.arange(len(turns)), visit) for visit in _group_by_axis(turns)])
    every = (visits[:, None, :, None] * tilts).reshape(-1, len(turns), 3)
    effective = every[every.any(axis=(1, 2))]
    return np.concatenate([effective, np.zeros((len(effective), rests, 3))], axis=1)


def _encoder_errors(turns: Sequence[Observation], rests: int, uncertainty: Uncertainty) -> Array | None:
    """Return `VectorInputs.encoder_errors_rad_s` (P, N, 3), one for each angle of a joint where arcs begin or end.

    Sweeps in both directions share these angles, so repeats do not reduce the errors. Return None if all sweeps are
    whole turns.
    """
    arcs = [None if turn.arc_rad is None else (turn.joint_name, *turn.arc_rad) for turn in turns]
    marks = list(dict.fromkeys((arc[0], end) for arc in arcs if arc is not None for end in arc[1:]))
    if not marks:
        return None
    errors = np.zeros((len(marks), len(turns) + rests, 3))
    for index, (turn, arc) in enumerate(zip(turns, arcs, strict=True)):
        if arc is not None:
            joint, low, high = arc
            by_one = uncertainty.angle_std_rad / (high - low) * turn.speed_rad_s * turn.axis_flange
            errors[marks.index((joint, high)), index] += by_one
            errors[marks.index((joint, low)), index] -= by_one
    return errors


def list_mount_rotations(stages: Sequence[int], rests: int, mount_deg: float) -> Array | None:
    """Return `VectorInputs.mount_turns_rad` (3 S, N, 3), for mounts in S stages that may be off by `mount_deg`.

    `stages` are the stages of all sweeps; the N rows are these sweeps and then `rests` zeros, because mounts do not
    affect rests. Return None if there is only one stage.
    """
    first, *others = dict.fromkeys(stages)
    if not others:
        return None
    by_axis = np.radians(mount_deg) / np.sqrt(3) * np.eye(3)[:, None, :]
    per_stage = [np.where(np.equal(stages, stage)[:, None], by_axis, 0.0) for stage in (*others, first)]
    rotations = np.concatenate(per_stage)
    return np.concatenate([rotations, np.zeros((len(rotations), rests, 3))], axis=1)


def _group_by_axis(turns: Sequence[Observation]) -> list[list[int]]:
    """Return the indices of consecutive sweeps about one axis, group by group."""
    groups: list[list[int]] = [[0]]
    for index, (last, turn) in enumerate(pairwise(turns), start=1):
        if turn.joint_name == last.joint_name and abs(turn.axis_flange @ last.axis_flange) > SAME_AXIS_COSINE:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups


def list_given(environment: MeasurementEnvironment, name: str) -> EarthRatePrior:
    """Return the prior knowledge for an estimate of the Earth's rate: data of the site, the arm and sensor `name`."""
    site, uncertainty = environment.site, environment.uncertainty
    return EarthRatePrior(
        up=np.array(site.up),
        latitude_rad=site.latitude_rad,
        g_sensitivity=uncertainty.find_stated_size("g_sensitivity_deg_s_g", name) > 0,
        repeatability_rad=uncertainty.repeatability_std_rad,
        state_jitter_s=environment.state_jitter_s,
    )


def list_uncertainties(
    environment: MeasurementEnvironment, name: str, earth_rate: EarthRate | None, stamp_std_s: float | None = None
) -> UnknownErrors:
    """Return the stated uncertainties for the budget of sensor `name`, and those of the clock and the Earth's rate.

    `stamp_std_s` is the standard deviation of the samples' time stamps, None if unknown.
    """
    uncertainty, clock = environment.uncertainty, environment.clock
    return UnknownErrors(
        clock_std=clock.std,
        clock_dof=clock.dof,
        clock_half_width=None if clock.comparisons else PPM * uncertainty.controller_clock_ppm,
        clock_source="compared with "
        + (" and ".join(comparison.by for comparison in clock.comparisons) or "no other clock"),
        state_jitter_s=environment.state_jitter_s,
        state_jitter_dof=environment.state_jitter_dof,
        axis_rad=float(np.radians(uncertainty.axis_deg)),
        repeatability_rad=float(np.radians(uncertainty.repeatability_deg)),
        angle_std_rad=0.0 if uncertainty.angle_std_deg is None else uncertainty.angle_std_rad,
        mount_rad=float(np.radians(uncertainty.mount_deg)),
        stamp_std_s=stamp_std_s or 0.0,
        sensor_offset_m=uncertainty.sensor_offset_mm / 1000,
        g_sensitivity_rad_s_per_g=float(np.radians(uncertainty.find_stated_size("g_sensitivity_deg_s_g", name))),
        earth_rate=earth_rate is None and environment.site.earth_rate_rad_s is None,
        earth_covariance_rad2_s2=None if earth_rate is None else earth_rate.covariance_rad2_s2,
        earth_dof=np.inf if earth_rate is None else earth_rate.dof,
    )
