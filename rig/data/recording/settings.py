"""The typed settings by which a recording is judged: they are stored in the recording and have their own version.

The configuration of a run is stored too, but as text for people, and its keys may change with the version of the rig.
These settings judge a recording later exactly as its run did; `rig solve --set` changes them.
"""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from rig.config.judging.judging_keys import (
    SENSOR_KEYS,
    ExternalResult,
    NonNegative,
    ObservationKeys,
    UncertaintyKeys,
    refuse_missing_keys,
)
from rig.config.judging.verdict_limits import LIMITS, Limits
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.recording.recorded_sensor import ALIGNED_MOUNTING, Mounting, check_rotation
from rig.data.validation import Finite, OfJoints, Positive, parse_json, validate
from rig.errors import Refused
from rig.errors.quoting import quote
from rig.estimation.earth import EARTH_RATE_RAD_S

if TYPE_CHECKING:
    from rig.config.judging.judging_sections import SiteSection
    from rig.config.models import RigConfig
    from rig.config.procedures.hand_sections import ByHandSection
    from rig.motion.steps import Dwell, Plan

SCHEMA = "rig.settings/1"

Vector3 = tuple[Finite, Finite, Finite]


class ObservationThresholds(ObservationKeys):
    """The conditions under which a revolution is averaged.

    - `max_lost_fraction`: largest fraction of missing samples.
    - `max_speed_deviation`: largest deviation of the joint's smoothed rate from its mean, as a fraction.
    - `max_axis_deviation_deg`: largest angle between the reading and the axis of rotation.
    """

    @model_validator(mode="before")
    @classmethod
    def complete(cls, document: Any) -> Any:
        """Return the recorded keys (`document`) unchanged. Raise ValueError naming missing ones."""
        return refuse_missing_keys(cls, document)


@dataclass(frozen=True, slots=True)
class KnownReference:
    """The sensor `name` with a known calibration, from a turntable: rate = scale · (reading + bias_rad_s)."""

    name: str
    scale: tuple[Positive, Positive, Positive]
    bias_rad_s: Vector3


@dataclass(frozen=True, slots=True)
class Site:
    """The site of the arm, in its base frame: `up` (unit vector), gravity, and the Earth's rate, if known.

    Of the magnetic field, at most the norm is known, and whether the field points upwards. If the heading is unknown,
    the latitude may be known although the Earth's rate in the base frame is not. `…_expanded_…` are expanded
    uncertainties (k = 2), None if not stated.
    """

    up: Vector3
    gravity_m_s2: Positive
    earth_rate_rad_s: Vector3 | None
    magnetic_field_t: Positive | None = None
    magnetic_field_upwards: bool = False
    latitude_rad: Annotated[float, Field(ge=-np.pi / 2, le=np.pi / 2)] | None = None
    gravity_expanded_m_s2: Positive | None = None
    magnetic_field_expanded_t: Positive | None = None

    @property
    def down_m_s2(self) -> NDArray[np.float64]:
        """Gravity (3,), m/s², in the base frame."""
        return -self.gravity_m_s2 * np.array(self.up)


class Uncertainty(UncertaintyKeys[dict[str, NonNegative]]):
    """Half-widths of errors that no recording shows; all values within a half-width are equally likely.

    `angle_std_deg` is the standard deviation of a joint's angle by its encoder, None if not stated. Errors of sensors
    are keyed by the sensor's name. `decision_rule` compares a limit with the value alone ("simple") or with the value
    and its expanded uncertainty ("guard_band").
    """

    @model_validator(mode="before")
    @classmethod
    def complete(cls, document: Any) -> Any:
        """Return the recorded keys (`document`) unchanged. Raise ValueError naming missing ones."""
        return refuse_missing_keys(cls, document)

    @property
    def angle_std_rad(self) -> float:
        """The standard deviation of a joint's angle by its encoder. Raise Refused `angle_std_not_stated`."""
        if self.angle_std_deg is None:
            raise _angle_std_not_stated()
        return float(np.radians(self.angle_std_deg))

    @property
    def repeatability_std_rad(self) -> float:
        """The standard deviation of the arm's return to an angle, rad."""
        return float(np.radians(self.repeatability_deg) / np.sqrt(3))

    def knows(self, name: str) -> bool:
        """Return whether error sizes are stated for the sensor `name`."""
        return all(name in getattr(self, what) for what in SENSOR_KEYS)

    def find_stated_size(self, what: ExternalResult, name: str) -> float:
        """Return the stated size of the error `what` of the sensor `name`."""
        sizes: dict[str, float] = getattr(self, what)
        return sizes[name]


@dataclass(frozen=True, slots=True)
class SolveOptions:
    """The settings for solving external readings with their motion (`motion_file`).

    - `any_mounting`: whether the sensor may have any mounting on the body.
    - `find_clock`: whether the attitudes have a clock of their own; `exact_rates`: whether their rates are exact, as of
      a rate table; `window_s`: duration over which attitudes are averaged for a gyroscope's increments, None for an
      automatic choice.
    - `estimator`: its name; None to choose the one that suits each quantity.
    - `only`: the kinds of sensors to calibrate; empty for all that are recorded.
    """

    any_mounting: bool = False
    find_clock: bool = False
    exact_rates: bool = False
    window_s: Positive | None = None
    estimator: str | None = None
    only: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class HandSettings:
    """The settings of a session by hand, and its planned numbers of `flips` and whole `turns`.

    - `rest_s`: the time from the item's coming to rest to the next request.
    - `box_rad`: standard deviation of the angles between the item's faces from right angles.
    - `closure_rad`: standard deviation of the angle between the beginning and the end of a whole turn.
    - `wanted_scale_u`: the U of the scale factors at which the session may end early, None for no target.
    """

    flips: Annotated[int, Field(ge=0)]
    turns: Annotated[int, Field(ge=0)]
    rest_s: Positive
    box_rad: Positive
    closure_rad: Positive
    wanted_scale_u: Positive | None = None


@dataclass(frozen=True, slots=True)
class PlannedSweep:
    """A sweep of the whole procedure: its index in the plan, its joint, "cw" or "ccw", its speed and its angle."""

    index: int
    joint_name: str
    direction: str
    speed_rad_s: Positive
    angle_rad: Positive


@dataclass(frozen=True, slots=True)
class PlannedDwell:
    """A dwell of the whole procedure: its index in the plan, the joint angles, and the repeat, from 0."""

    index: int
    q_rad: OfJoints
    repeat: Annotated[int, Field(ge=0)]


@dataclass(frozen=True, slots=True)
class RunSettings:
    """The task of a run, and the settings to solve and judge it.

    - procedure: the procedure's name.
    - then_verify: whether a verification was to follow the calibration.
    - observation, limits, uncertainty: sections of the configuration; external recordings have no limits and no
      uncertainty.
    - to_calibrate: names of the sensors to calibrate.
    - reference: the sensor with a given calibration.
    - home_q_rad: angles of the turner's joints, of which there may be none.
    - planned_sweeps, planned_dwells: of the complete procedure, even if the run was interrupted.
    - site: location of the arm.
    - matrix_corrected: names of the sensors whose readings the complete matrix corrects.
    - second_order: whether the accelerometers' model has terms of second order.
    - finds_earth_rate: whether the Earth's rate is estimated from the gyroscopes' readings.
    - extension_m: end of the extension that carries the sensors, in the flange's frame.
    - elsewhere: settings of an external recording, None for a recording of the rig.
    - mounts: nominal rotations from the flange's to the item's frame by stage, empty for an item that is mounted once.
    - stage: number of this recording's stage, from 0.
    - by_hand: settings of a session by hand, None for other runs.
    - reference_c: temperature at which a calibration over temperature is stated, None for other calibrations.
    """

    procedure: str
    then_verify: bool
    observation: ObservationThresholds
    limits: Limits | None
    to_calibrate: Annotated[tuple[str, ...], Field(min_length=1)]
    reference: KnownReference | None
    home_q_rad: OfJoints
    planned_sweeps: tuple[PlannedSweep, ...]
    site: Site
    uncertainty: Uncertainty | None
    matrix_corrected: tuple[str, ...] = ()
    planned_dwells: tuple[PlannedDwell, ...] = ()
    second_order: bool = False
    finds_earth_rate: bool = False
    extension_m: Vector3 = (0.0, 0.0, 0.0)
    elsewhere: SolveOptions | None = None
    mounts: tuple[Mounting, ...] = ()
    stage: Annotated[int, Field(ge=0)] = 0
    by_hand: HandSettings | None = None
    reference_c: float | None = None

    @property
    def mount(self) -> Mounting:
        """The nominal rotation from the flange's frame to the item's, to which sensor mountings refer."""
        return self.mounts[self.stage] if self.mounts else ALIGNED_MOUNTING

    @property
    def stated_uncertainty(self) -> Uncertainty:
        """The uncertainty that a run states. Raise ValueError for external readings, which state none."""
        if self.uncertainty is None:
            raise ValueError("its settings state no uncertainty, but those of a run do")
        return self.uncertainty

    @property
    def has_arcs(self) -> bool:
        """Whether a sweep is planned that is not a whole turn."""
        from rig.motion.steps import closes

        return not all(closes(sweep.angle_rad) for sweep in self.planned_sweeps)

    @property
    def movement(self) -> tuple[object, ...]:
        """The settings that two recordings must share for their sweeps and dwells to form one run."""
        steps = self.planned_sweeps, self.planned_dwells
        return self.procedure, self.then_verify, self.home_q_rad, *steps, self.mounts, self.by_hand

    def apply_overrides(self, overrides: Sequence[str]) -> "RunSettings":
        """Return the settings with other thresholds or limits.

        An override is `limits.scale_std=0.001`, or if sweeps are arcs `uncertainty.angle_std_deg=0.02`. Raise Refused
        `unknown_setting` or `wrong_setting`, which list the possible settings.
        """
        changed = self
        for item in overrides:
            changed = _override(changed, item)
        return changed

    def document(self) -> dict[str, Any]:
        """Return the settings as plain values, by key."""
        judging = {"observation": self.observation, "limits": self.limits, "uncertainty": self.uncertainty}
        return asdict(self) | {
            key: None if section is None else section.model_dump() for key, section in judging.items()
        }

    def to_json(self) -> str:
        """Return the settings as in a run file."""
        return json.dumps({"schema": SCHEMA, **self.document()}, allow_nan=False)


def settings_from_json(text: str) -> RunSettings:
    """Return the settings that `to_json` wrote. Raise ValueError naming the error."""
    document = parse_json(text)
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise ValueError(f"the schema of its settings is {quote(schema)}; this version of the rig reads {SCHEMA!r}")
    settings = validate(RunSettings, document, "settings")
    if settings.elsewhere is None and (settings.limits is None or settings.uncertainty is None):
        raise ValueError("its settings have no limits or no uncertainty, but those of a run have both")
    if settings.mounts and settings.stage >= len(settings.mounts):
        raise ValueError(f"its settings are of stage {settings.stage}, but there are {len(settings.mounts)} mounts")
    for mount in settings.mounts:
        check_rotation(mount, "the mount of a stage")
    return settings


def settings_of(config: "RigConfig", plan: "Plan") -> RunSettings:
    """Return the settings of a new run; `plan` is the plan of the whole procedure.

    Raise Refused `angle_std_not_stated` if sweeps are arcs and the file does not state the encoders' error.
    """
    from rig.config.procedures.hand_sections import ByHandSection

    reference = None
    if config.reference is not None:
        name, section = config.reference
        reference = KnownReference(name, section.turntable.scale, section.turntable.bias_rad_s)
    uncertainty = uncertainty_of(config)
    planned = tuple(
        PlannedSweep(sweep.index, sweep.joint_name, sweep.direction, sweep.speed_rad_s, sweep.angle_rad)
        for sweep in plan.sweeps
    )
    settings = RunSettings(
        procedure=config.procedure.name,
        then_verify=config.procedure.then_verify,
        observation=ObservationThresholds(**config.observation.model_dump()),
        limits=_limits(config),
        to_calibrate=tuple(config.to_calibrate),
        reference=reference,
        home_q_rad=plan.home_q_rad,
        planned_sweeps=planned,
        matrix_corrected=tuple(name for name, sensor in config.to_calibrate.items() if sensor.correction == "matrix"),
        site=site_of(config.site),
        uncertainty=uncertainty,
        planned_dwells=_plan_dwells(plan.dwells),
        second_order=config.procedure.accelerometer_order == 2,
        finds_earth_rate=config.procedure.finds_earth_rate,
        extension_m=config.turner.extension_m,
        mounts=tuple(stage.mount for stage in plan.stages),
        by_hand=hand_settings(config.procedure) if isinstance(config.procedure, ByHandSection) else None,
        reference_c=getattr(config.procedure, "reference_c", None),
    )
    if settings.has_arcs and uncertainty.angle_std_deg is None:
        raise _angle_std_not_stated()
    return settings


def _limits(config: "RigConfig") -> Limits:
    """Return the limits of a configuration, with the targets at which its procedure ends."""
    from rig.config.procedures.procedure_sections import SixObservationSection

    limits, section = config.limits.model_dump(), config.procedure
    if isinstance(section, SixObservationSection):
        wanted = {"scale_u": section.target_scale_u, "bias_u_rad_s": section.target_bias_u_rad_s}
        limits |= {key: value for key, value in wanted.items() if limits[key] is None}
    return Limits(**limits)


def hand_settings(section: "ByHandSection") -> HandSettings:
    """Return the settings of a session by hand."""
    return HandSettings(
        flips=section.flips,
        turns=section.turns,
        rest_s=section.rest_s,
        box_rad=float(np.radians(section.squareness_deg)),
        closure_rad=float(np.radians(section.closure_deg)),
        wanted_scale_u=section.target_scale_u,
    )


def _angle_std_not_stated() -> Refused:
    return Refused(
        "angle_std_not_stated",
        "a sweep is not a whole turn, so the encoders measure its angle, but their error is not stated",
        "Give uncertainty.angle_std_deg, how far a joint may be from the angle of its encoder, or sweep whole turns",
    )


def _plan_dwells(dwells: "Sequence[Dwell]") -> tuple[PlannedDwell, ...]:
    """Return the planned dwells, each with the number of previous dwells in its attitude."""
    repeats: Counter[tuple[float, ...]] = Counter()
    planned = []
    for dwell in dwells:
        planned.append(PlannedDwell(dwell.index, dwell.q_rad, repeats[dwell.q_rad]))
        repeats[dwell.q_rad] += 1
    return tuple(planned)


def site_of(section: "SiteSection") -> Site:
    """Return the site, with the Earth's rate in the frame of the base if latitude and heading are given."""
    earth_rate: Vector3 | None = None
    if section.latitude_deg is not None and section.heading_deg is not None:
        up = np.array(section.up)
        ahead = np.array([1.0, 0.0, 0.0]) - up[0] * up
        ahead /= np.linalg.norm(ahead)
        heading, latitude = np.radians([section.heading_deg, section.latitude_deg])
        north = np.cos(heading) * ahead + np.sin(heading) * np.cross(up, ahead)
        x, y, z = (EARTH_RATE_RAD_S * (np.cos(latitude) * north + np.sin(latitude) * up)).tolist()
        earth_rate = x, y, z
    return Site(
        up=section.up,
        gravity_m_s2=section.gravity_m_s2,
        earth_rate_rad_s=earth_rate,
        magnetic_field_t=_tesla(section.magnetic_field_ut),
        magnetic_field_upwards=section.magnetic_field_upwards,
        latitude_rad=None if section.latitude_deg is None else float(np.radians(section.latitude_deg)),
        gravity_expanded_m_s2=section.gravity_uncertainty_m_s2,
        magnetic_field_expanded_t=_tesla(section.magnetic_field_uncertainty_ut),
    )


def _tesla(microtesla: float | None) -> float | None:
    return None if microtesla is None else microtesla / 1e6


def uncertainty_of(config: "RigConfig") -> Uncertainty:
    """Return the stated uncertainties. A sensor without a statement has its part's default."""
    stated: dict[str, Any] = config.uncertainty.model_dump()
    of_sensors: dict[str, Any] = {
        what: {
            name: getattr(PARTS[sensor.part], what) if stated[what] is None else stated[what]
            for name, sensor in config.sensors.items()
        }
        for what in SENSOR_KEYS
    }
    return Uncertainty(**{**stated, **of_sensors})


def find_setting(item: str) -> str:
    """Return the path that `section.key=value` sets. Raise Refused `unknown_setting` if no recording has it."""
    path = item.partition("=")[0].strip()
    if path not in _settable():
        raise Refused(
            "unknown_setting",
            f"a recording has no setting {quote(path)} that could be changed",
            f"{_suggest_setting(path)}Set one of {', '.join(_settable())}",
        )
    return path


def _suggest_setting(path: str) -> str:
    """Return a question for the setting that a wrong path may mean, or an empty text."""
    from difflib import get_close_matches

    alike = get_close_matches(path, _settable(), n=1)
    return f"Did you mean {alike[0]}? " if alike else ""


def _override(settings: RunSettings, item: str) -> RunSettings:
    """Return the settings with one `section.key=value` replaced. Raise Refused `unknown_setting`, `wrong_setting`."""
    path, value = find_setting(item), item.partition("=")[2]
    section, _, key = path.partition(".")
    if settings.elsewhere is not None:
        raise Refused(
            "unknown_setting", "readings from files are not judged by thresholds or limits", f"Leave out {section}"
        )
    document = settings.document()
    document[section][key] = value.strip()
    try:
        return validate(RunSettings, document, "settings")
    except ValueError as error:
        raise Refused("wrong_setting", str(error), f"Give a number, for example {path}=0.001") from None


def setting_path(key: str) -> str:
    """Return the full path of a threshold or limit: `observation.max_lost_fraction` for `max_lost_fraction`."""
    return next((path for path in _settable() if path.rpartition(".")[2] == key), key)


def _settable() -> tuple[str, ...]:
    thresholds = (f"observation.{key}" for key in ObservationThresholds.model_fields)
    return (*thresholds, *(f"limits.{key}" for key in LIMITS), "uncertainty.angle_std_deg")
