"""What a recording is judged by: recorded beside it, typed, and with a version of its own.

The configuration a run was made with is kept as text, for people. Its keys may change from one version of the rig to
the next; these do not, so that a recording is judged as it was, or by what `rig solve --set` says instead.
"""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from rig.config.judging.judged_by import (
    OF_SENSORS,
    NonNegative,
    ObservationKeys,
    OfSensor,
    UncertaintyKeys,
    refuse_missing_keys,
)
from rig.config.judging.limits import LIMITS, Limits
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.checked import Finite, OfJoints, Positive, checked, parsed
from rig.data.recording.recorded_sensor import AS_THE_FLANGE, Mounting, check_rotation
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
    """What an averaged revolution must satisfy to be used.

    Of its samples `max_lost_fraction` may be missing; the joint's rate, smoothed, may stray from its mean by the
    fraction `max_speed_deviation`; the reading may point `max_axis_deviation_deg` away from the turn.
    """

    @model_validator(mode="before")
    @classmethod
    def complete(cls, document: Any) -> Any:
        """Return the keys of a recording. Raise ValueError where one is missing."""
        return refuse_missing_keys(cls, document)


@dataclass(frozen=True, slots=True)
class KnownReference:
    """The sensor `name` whose calibration is known, from a turntable: rate = scale · (reading + bias_rad_s)."""

    name: str
    scale: tuple[Positive, Positive, Positive]
    bias_rad_s: Vector3


@dataclass(frozen=True, slots=True)
class Site:
    """Where the arm stands, in its base frame: `up` (unit vector), gravity, the Earth's rate where it is known.

    Of the magnetic field its size is known or nothing, and whether it rises from the ground. The latitude may be known
    where the Earth's rate is not, for want of a heading. `…_expanded_…` are expanded uncertainties (k = 2), None where
    nobody stated any.
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
        """(3,) gravity in the base frame."""
        return -self.gravity_m_s2 * np.array(self.up)


class Uncertainty(UncertaintyKeys[dict[str, NonNegative]]):
    """Half-widths of what no recording shows: all values between, either way, are equally likely.

    But `angle_std_deg`, which is a standard deviation, None where nobody stated it: of a joint's angle about what its
    encoder tells.

    Those of sensors stand by name.
    `decision_rule` says whether a limit is held against the value alone ("simple") or against the value with its
    expanded uncertainty ("guard_band").
    """

    @model_validator(mode="before")
    @classmethod
    def complete(cls, document: Any) -> Any:
        """Return the keys of a recording. Raise ValueError where one is missing."""
        return refuse_missing_keys(cls, document)

    @property
    def angle_std_rad(self) -> float:
        """Standard deviation of a joint's angle. Raises Refused `angle_std_not_stated`."""
        if self.angle_std_deg is None:
            raise _angle_std_not_stated()
        return float(np.radians(self.angle_std_deg))

    @property
    def repeatability_std_rad(self) -> float:
        """Standard deviation of an angle of the arm's, each time that it comes back."""
        return float(np.radians(self.repeatability_deg) / np.sqrt(3))

    def knows(self, name: str) -> bool:
        """Return whether `of` has an answer for the sensor `name`."""
        return all(name in getattr(self, what) for what in OF_SENSORS)

    def of(self, what: OfSensor, name: str) -> float:
        """Return the size that is stated for the sensor `name`."""
        sizes: dict[str, float] = getattr(self, what)
        return sizes[name]


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """How readings are solved that were recorded elsewhere, whose motion a file tells (`motion_file`).

    - `any_mounting`: the sensor's axes need not lie along those of the body whose attitudes are given.
    - `find_clock`: the attitudes are on a clock of their own; `exact_rates`: their rates are exact, as a rate table's
      are; `window_s`: over which attitudes are averaged for a gyroscope's increments, None for what suits.
    - `estimator`: the one that was asked for, None for the one that suits each quantity.
    - `only`: the sensors to calibrate, as their quantities call them, all that were recorded where there are none.
    """

    any_mounting: bool = False
    find_clock: bool = False
    exact_rates: bool = False
    window_s: Positive | None = None
    estimator: str | None = None
    only: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ByHand:
    """How a session by hand is solved, and what it was to have: so many `flips` and whole `turns`.

    The next move is asked for `rest_s` after the item came to rest. `box_rad` and `closure_rad` are standard
    deviations: of the item's faces from right angles, and of a whole turn's end from its beginning.
    """

    flips: Annotated[int, Field(ge=0)]
    turns: Annotated[int, Field(ge=0)]
    rest_s: Positive
    box_rad: Positive
    closure_rad: Positive
    wanted_scale_u: Positive | None = None


@dataclass(frozen=True, slots=True)
class PlannedSweep:
    """A sweep the whole procedure has: its place in the plan, its joint, "cw" or "ccw", its speed, how far it turns."""

    index: int
    joint_name: str
    direction: str
    speed_rad_s: Positive
    angle_rad: Positive


@dataclass(frozen=True, slots=True)
class PlannedDwell:
    """A dwell the whole procedure has: its place in the plan, the joint angles, which time the attitudes are gone
    through, from 0."""

    index: int
    q_rad: OfJoints
    repeat: Annotated[int, Field(ge=0)]


@dataclass(frozen=True, slots=True)
class RunSettings:
    """What a run was to do, and how it is solved and judged.

    - `procedure`: the procedure's name; `then_verify`: whether a verification was to follow the calibration.
    - `observation`, `limits`, `uncertainty`: what the configuration's sections of these names state. Recordings of
      others (`elsewhere`) have no limits and no uncertainty.
    - `to_calibrate`: names of the sensors to calibrate; `matrix_corrected`: those of them whose readings the whole
      matrix corrects; `reference`: the sensor whose calibration is known.
    - `home_q_rad`: angles of the turner's joints, of which there may be none.
    - `planned_sweeps`, `planned_dwells`: those of the whole procedure, however often the run was interrupted.
    - `site`: where the arm stands; `finds_earth_rate`: whether the Earth's rate is to be found from the gyroscopes'
      readings instead of taken from the site.
    - `second_order`: whether the accelerometers' model has terms of second order.
    - `extension_m`: end of the extension on which the sensors sit, in the flange's frame.
    - `mounts`: nominal rotations from the flange's frame to the item's in the stages of the procedure, none if the item
      stays mounted as it is; `stage`: number of this recording's stage, from 0.
    - `elsewhere`: how readings of others are solved; `by_hand`: how a session by hand is solved.
    - `reference_c`: temperature at which a calibration over temperature is stated, None of any other.
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
    elsewhere: Elsewhere | None = None
    mounts: tuple[Mounting, ...] = ()
    stage: Annotated[int, Field(ge=0)] = 0
    by_hand: ByHand | None = None
    reference_c: float | None = None

    @property
    def mount(self) -> Mounting:
        """The nominal rotation from the flange's frame to the item's, in which the sensors' mountings stand."""
        return self.mounts[self.stage] if self.mounts else AS_THE_FLANGE

    @property
    def stated_uncertainty(self) -> Uncertainty:
        """The uncertainty that a run states. Raise ValueError of readings of others, which state none."""
        if self.uncertainty is None:
            raise ValueError("its settings state no uncertainty, but those of a run do")
        return self.uncertainty

    @property
    def has_arcs(self) -> bool:
        """Whether a sweep is planned that is no whole turn."""
        from rig.motion.steps import closes

        return not all(closes(sweep.angle_rad) for sweep in self.planned_sweeps)

    @property
    def movement(self) -> tuple[object, ...]:
        """What two recordings must have in common for their sweeps and dwells to be those of one run."""
        steps = self.planned_sweeps, self.planned_dwells
        return self.procedure, self.then_verify, self.home_q_rad, *steps, self.mounts, self.by_hand

    def with_overrides(self, overrides: Sequence[str]) -> "RunSettings":
        """Return the settings with other thresholds or limits: `limits.scale_std=0.001`.

        Or with encoders of arcs that are better or worse than was stated: `uncertainty.angle_std_deg=0.02`.

        Raise Refused `unknown_setting` or `wrong_setting`, which say what can be set.
        """
        changed = self
        for item in overrides:
            changed = _overridden(changed, item)
        return changed

    def document(self) -> dict[str, Any]:
        """The settings as plain values, by key."""
        judging = {"observation": self.observation, "limits": self.limits, "uncertainty": self.uncertainty}
        return asdict(self) | {key: None if each is None else each.model_dump() for key, each in judging.items()}

    def to_json(self) -> str:
        """The settings as they stand in a run file."""
        return json.dumps({"schema": SCHEMA, **self.document()}, allow_nan=False)


def settings_from_json(text: str) -> RunSettings:
    """What `to_json` wrote. Raises ValueError naming what is wrong."""
    document = parsed(text)
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise ValueError(f"the schema of its settings is {quote(schema)}; this version of the rig reads {SCHEMA!r}")
    settings = checked(RunSettings, document, "settings")
    if settings.elsewhere is None and (settings.limits is None or settings.uncertainty is None):
        raise ValueError("its settings have no limits or no uncertainty, but those of a run have both")
    if settings.mounts and settings.stage >= len(settings.mounts):
        raise ValueError(f"its settings are of stage {settings.stage}, and there are {len(settings.mounts)} mounts")
    for mount in settings.mounts:
        check_rotation(mount, "the mount of a stage")
    return settings


def settings_of(config: "RigConfig", plan: "Plan") -> RunSettings:
    """The settings of a new run; `plan` is that of the whole procedure.

    Raises Refused `angle_std_not_stated` where it has arcs that nobody says how well the encoders tell.
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
        matrix_corrected=tuple(name for name, each in config.to_calibrate.items() if each.correction == "matrix"),
        site=site_of(config.site),
        uncertainty=uncertainty,
        planned_dwells=_planned(plan.dwells),
        second_order=config.procedure.accelerometer_order == 2,
        finds_earth_rate=config.procedure.finds_earth_rate,
        extension_m=config.turner.extension_m,
        mounts=tuple(stage.mount for stage in plan.stages),
        by_hand=by_hand_of(config.procedure) if isinstance(config.procedure, ByHandSection) else None,
        reference_c=getattr(config.procedure, "reference_c", None),
    )
    if settings.has_arcs and uncertainty.angle_std_deg is None:
        raise _angle_std_not_stated()
    return settings


def _limits(config: "RigConfig") -> Limits:
    """The limits of the file, and what its procedure repeats for."""
    from rig.config.procedures.procedure_sections import SixObservationSection

    said, section = config.limits.model_dump(), config.procedure
    if isinstance(section, SixObservationSection):
        wanted = {"scale_u": section.target_scale_u, "bias_u_rad_s": section.target_bias_u_rad_s}
        said |= {key: value for key, value in wanted.items() if said[key] is None}
    return Limits(**said)


def by_hand_of(section: "ByHandSection") -> ByHand:
    """How a session by hand will be solved, and what it is to have."""
    return ByHand(
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
        "a sweep is no whole turn, so the encoders measure how far it went, and their error is not stated",
        "Give uncertainty.angle_std_deg, how far a joint may be from the angle of its encoder, or sweep whole turns",
    )


def _planned(dwells: "Sequence[Dwell]") -> tuple[PlannedDwell, ...]:
    """The planned dwells, each with how often its attitude was there before."""
    seen: Counter[tuple[float, ...]] = Counter()
    planned = []
    for dwell in dwells:
        planned.append(PlannedDwell(dwell.index, dwell.q_rad, seen[dwell.q_rad]))
        seen[dwell.q_rad] += 1
    return tuple(planned)


def site_of(section: "SiteSection") -> Site:
    """The site, with the Earth's rate in the frame of the base, where latitude and heading are known."""
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
    """The uncertainties that the file states; what it does not say of a sensor is its part's."""
    said: dict[str, Any] = config.uncertainty.model_dump()
    of_sensors: dict[str, Any] = {
        what: {
            name: getattr(PARTS[sensor.part], what) if said[what] is None else said[what]
            for name, sensor in config.sensors.items()
        }
        for what in OF_SENSORS
    }
    return Uncertainty(**{**said, **of_sensors})


def known_setting(item: str) -> str:
    """The path of what `section.key=value` sets. Raises Refused `unknown_setting` where no recording has that."""
    path = item.partition("=")[0].strip()
    if path not in _settable():
        raise Refused(
            "unknown_setting",
            f"a recording has no setting {quote(path)} that could be changed",
            f"Set one of {', '.join(_settable())}",
        )
    return path


def _overridden(settings: RunSettings, item: str) -> RunSettings:
    """The settings with one `section.key=value` laid over them."""
    path, value = known_setting(item), item.partition("=")[2]
    section, _, key = path.partition(".")
    if settings.elsewhere is not None:
        raise Refused(
            "unknown_setting", "readings from files are not judged by thresholds or limits", f"Leave out {section}"
        )
    document = settings.document()
    document[section][key] = value.strip()
    try:
        return checked(RunSettings, document, "settings")
    except ValueError as error:
        raise Refused("wrong_setting", str(error), f"Give a number, as in {path}=0.001") from None


def setting(key: str) -> str:
    """The full path of a threshold or limit: `max_lost_fraction` is `observation.max_lost_fraction`."""
    return next((path for path in _settable() if path.rpartition(".")[2] == key), key)


def _settable() -> tuple[str, ...]:
    thresholds = (f"observation.{key}" for key in ObservationThresholds.model_fields)
    return (*thresholds, *(f"limits.{key}" for key in LIMITS), "uncertainty.angle_std_deg")
