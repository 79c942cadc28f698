"""From recordings and their surroundings to what the vector model and its budget are made of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rig.analysis.clock import PPM
from rig.analysis.surroundings import Surroundings
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Unknown
from rig.estimation.gyroscope.earth_rate import EarthRate, EarthRatePrior
from rig.estimation.gyroscope.own_errors import KnownSensor
from rig.estimation.gyroscope.vector_fit import Seen
from rig.motion.geometry import AXIS_ERRORS
from rig.observation.average import Average
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import by_axis

ZEROS = tuple(place for place, name in enumerate(AXIS_ERRORS) if name.startswith("zero"))
SAME_AXIS = 1 - 1e-6  # of the scalar product: the joints beside it stand where they were to 1.4 mrad
WAVE_SHARE = 0.3  # of the error of a joint's zero, what its encoder errs once or twice a turn; assumed


@dataclass(frozen=True, slots=True)
class Part:
    """What one recording adds of a sensor: its turns and rests, and when its clock began by that of the first.

    The item was mounted anew for each `stage`; `mount` (3, 3) takes the flange's frame into the item's.
    """

    turns: Sequence[Observation]
    rests: Sequence[Average]
    since_s: float
    stage: int
    mount: Array | None


def see(recordings: Sequence[ObservedRun], sensor: str, surroundings: Surroundings) -> Seen:
    """Put together what the arm knows of each average of a sensor, in all recordings of a run.

    Speeds by a controller's clock that runs too fast are too small by that.
    """
    run = recordings[0].run
    parts = [
        Part(
            recording.sensors[sensor].revolutions,
            recording.sensors[sensor].rests,
            recording.clock_offset_s,
            recording.run.settings.stage,
            recording.motion.mount,
        )
        for recording in recordings
    ]
    seen = put_together(parts, surroundings)
    averages = [average for part in parts for average in (turn.average for turn in part.turns)]
    averages += [rest for part in parts for rest in part.rests]
    return replace(seen, sensor=_sensor_of(surroundings, sensor, run.sensors[sensor], averages))


def put_together(parts: Sequence[Part], surroundings: Surroundings) -> Seen:
    """What all parts of a run tell, the turns before the rests, without what is known of the sensor."""
    site, extension_m = surroundings.site, np.array(surroundings.extension_m)
    turns = [(turn, part.since_s) for part in parts for turn in part.turns]
    rests = [(rest, part.since_s) for part in parts for rest in part.rests]
    placed = [*((turn.average, since_s) for turn, since_s in turns), *rests]
    averages = [average for average, _ in placed]
    attitudes = np.array([average.attitude for average in averages], dtype=np.float64)
    turned = np.array([turn.speed_rad_s * turn.axis_flange for turn, _ in turns])
    arms_m = np.concatenate([lever_arms_m(each.turns, extension_m, each.mount) for each in parts])
    mounted = [part.stage for part in parts for _ in part.turns]
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    return Seen(
        means_rad_s=np.array([average.mean_rad_s for average in averages]),
        variances_rad2_s2=np.array([average.variance_rad2_s2 - average.drift_rad2_s2 for average in averages]),
        turns_rad_s=np.concatenate([turned * (1 + surroundings.clock.error), np.zeros((len(rests), 3))]),
        earth_rate_rad_s=earth,
        speed_std_rad_s=np.array([*(turn.speed_std_rad_s for turn, _ in turns), *np.zeros(len(rests))]),
        attitudes=attitudes,
        gravity_m_s2=attitudes @ site.down_m_s2,
        windows_s=np.array([(average.start_s + since_s, average.end_s + since_s) for average, since_s in placed]),
        joints=(*(turn.joint_name for turn, _ in turns), *[None] * len(rests)),
        axis_errors_rad_s=_axis_errors([turn for turn, _ in turns], len(rests), surroundings.uncertainty.axis_deg),
        return_errors_rad_s=_return_errors([turn for turn, _ in turns], len(rests), surroundings.uncertainty),
        encoder_errors_rad_s=_encoder_errors([turn for turn, _ in turns], len(rests), surroundings.uncertainty),
        mount_turns_rad=mount_turns(mounted, len(rests), surroundings.uncertainty.mount_deg),
        arms_m=np.concatenate([arms_m, np.zeros((len(rests), 3))]),
        noise_freedom=by_axis(average.freedom for average in averages),
        ripples=np.array([*(turn.ripple for turn, _ in turns), *np.zeros(len(rests))]),
        roundings_rad_s=np.sqrt(by_axis(average.rounding_rad2_s2 for average in averages)),
    )


def _sensor_of(
    surroundings: Surroundings, name: str, sensor: RecordedSensor, averages: Sequence[Average]
) -> KnownSensor:
    temperature_c = np.array([average.temperature_c for average in averages])
    known = known_sensor(surroundings.uncertainty, name, sensor.range_rad_s, temperature_c, sensor.unseen_change_k)
    return replace(known, temperature_words=sensor.temperature_words)


def known_sensor(
    known: Uncertainty, name: str, full_scale_rad_s: float, temperature_c: Array, temperature_step_k: float
) -> KnownSensor:
    """Return what is stated of the sensor `name` of that range, and how warm it was in each average (N,)."""
    return KnownSensor(
        nonlinearity=known.stated_size("nonlinearity_percent", name) / 100,
        full_scale_rad_s=full_scale_rad_s,
        bias_rad_s_per_k=float(np.radians(known.stated_size("bias_deg_s_k", name))),
        scale_per_k=PPM * known.stated_size("scale_ppm_k", name),
        instability_rad_s=float(np.radians(known.stated_size("bias_instability_deg_h", name) / 3600)),
        temperature_c=temperature_c,
        temperature_step_k=temperature_step_k,
    )


def lever_arms_m(turns: Sequence[Observation], extension_m: Array, mount: Array | None = None) -> Array:
    """Return (M, 3) from the axis that turns to where the sensors sit, in the item's frame; zero where no arm tells.

    The `mount` (3, 3) takes the flange's frame, in which the extension stands, into the item's; None: they are one.
    """
    mounted_m = extension_m if mount is None else mount @ extension_m
    known_m = [turn.arm_m + mounted_m if turn.arm_m is not None else np.zeros(3) for turn in turns]
    return np.reshape(known_m, (-1, 3))


def _axis_errors(turns: Sequence[Observation], rests: int, axis_deg: float) -> Array:
    """(P, N, 3) errors as in `Seen`, of the arm's angles, which may be off by `axis_deg` either way."""
    steady = np.array([name.startswith(("twist", "zero")) for name in AXIS_ERRORS])
    std = np.radians(axis_deg) / np.sqrt(3) * np.where(steady, 1.0, WAVE_SHARE)
    off = [std[:, None] * turn.speed_rad_s * turn.axis_errors for turn in turns if turn.axis_errors is not None]
    return np.concatenate([np.swapaxes(off, 0, 1), np.zeros((len(std), rests, 3))], axis=1)


def _return_errors(turns: Sequence[Observation], rests: int, known: Uncertainty) -> Array:
    """(P, N, 3) errors as in `Seen`: joints that turn a sweep's axis come back a little elsewhere every time."""
    errors = np.array([turn.speed_rad_s * turn.axis_errors for turn in turns if turn.axis_errors is not None])
    leaning = known.repeatability_std_rad * np.swapaxes(errors[:, ZEROS], 0, 1)
    visits = np.array([np.isin(np.arange(len(turns)), visit) for visit in _visits(turns)])
    off = (visits[:, None, :, None] * leaning).reshape(-1, len(turns), 3)
    off = off[off.any(axis=(1, 2))]
    return np.concatenate([off, np.zeros((len(off), rests, 3))], axis=1)


def _encoder_errors(turns: Sequence[Observation], rests: int, known: Uncertainty) -> Array | None:
    """(P, N, 3) errors as in `Seen`, of what a joint's encoder errs at each mark where arcs begin or end.

    Sweeps one way and the other have the same marks, so the same errors: these are no noise, and repeats do not lessen
    them. None where all sweeps are whole turns, which end at the mark where they began.
    """
    arcs = [None if turn.arc_rad is None else (turn.joint_name, *turn.arc_rad) for turn in turns]
    marks = list(dict.fromkeys((arc[0], end) for arc in arcs if arc is not None for end in arc[1:]))
    if not marks:
        return None
    off = np.zeros((len(marks), len(turns) + rests, 3))
    for place, (turn, arc) in enumerate(zip(turns, arcs, strict=True)):
        if arc is not None:
            joint, low, high = arc
            by_one = known.angle_std_rad / (high - low) * turn.speed_rad_s * turn.axis_flange
            off[marks.index((joint, high)), place] += by_one
            off[marks.index((joint, low)), place] -= by_one
    return off


def mount_turns(stages: Sequence[int], rests: int, mount_deg: float) -> Array | None:
    """(3 S, N, 3) turns as in `Seen`, of an item that may sit off its mount by `mount_deg` about each axis; or None."""
    first, *others = dict.fromkeys(stages)
    if not others:
        return None
    by_axis = np.radians(mount_deg) / np.sqrt(3) * np.eye(3)[:, None, :]
    own = [np.where(np.equal(stages, stage)[:, None], by_axis, 0.0) for stage in (*others, first)]
    found = np.concatenate(own)
    return np.concatenate([found, np.zeros((len(found), rests, 3))], axis=1)


def _visits(turns: Sequence[Observation]) -> list[list[int]]:
    """The places of sweeps that follow each other about one axis."""
    found: list[list[int]] = [[0]]
    for place, (last, turn) in enumerate(pairwise(turns), start=1):
        if turn.joint_name == last.joint_name and abs(turn.axis_flange @ last.axis_flange) > SAME_AXIS:
            found[-1].append(place)
        else:
            found.append([place])
    return found


def known_of(surroundings: Surroundings, name: str) -> EarthRatePrior:
    """What is known of surroundings and sensor before the Earth's rate is looked for."""
    site, uncertainty = surroundings.site, surroundings.uncertainty
    return EarthRatePrior(
        up=np.array(site.up),
        latitude_rad=site.latitude_rad,
        g_sensitivity=uncertainty.stated_size("g_sensitivity_deg_s_g", name) > 0,
        repeatability_rad=uncertainty.repeatability_std_rad,
        state_jitter_s=surroundings.state_jitter_s,
    )


def unknown_of(
    surroundings: Surroundings, name: str, earth_rate: EarthRate | None, stamp_std_s: float | None = None
) -> Unknown:
    """Return what no recording shows of the surroundings of the sensor `name`, and the Earth's rate it found.

    `stamp_std_s` is as of `RecordedSensor`.
    """
    known, clock = surroundings.uncertainty, surroundings.clock
    return Unknown(
        clock_std=clock.std,
        clock_freedom=clock.freedom,
        clock_half_width=None if clock.comparisons else PPM * known.controller_clock_ppm,
        clock_source="held against "
        + (" and ".join(comparison.by for comparison in clock.comparisons) or "no other clock"),
        state_jitter_s=surroundings.state_jitter_s,
        state_jitter_freedom=surroundings.state_jitter_freedom,
        axis_rad=float(np.radians(known.axis_deg)),
        repeatability_rad=float(np.radians(known.repeatability_deg)),
        angle_std_rad=0.0 if known.angle_std_deg is None else known.angle_std_rad,
        mount_rad=float(np.radians(known.mount_deg)),
        stamp_std_s=stamp_std_s or 0.0,
        sensor_offset_m=known.sensor_offset_mm / 1000,
        g_sensitivity_rad_s_per_g=float(np.radians(known.stated_size("g_sensitivity_deg_s_g", name))),
        earth_rate=earth_rate is None and surroundings.site.earth_rate_rad_s is None,
        earth_covariance_rad2_s2=None if earth_rate is None else earth_rate.covariance_rad2_s2,
        earth_freedom=np.inf if earth_rate is None else earth_rate.freedom,
    )
