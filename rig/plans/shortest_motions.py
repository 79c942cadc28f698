"""Candidate motions of the search for the shortest run: sweeps, attitudes, turns of a servo. Pure functions."""

from collections.abc import Iterator, Mapping
from itertools import product

from rig.config.models import RigConfig
from rig.config.procedures.attitude_sets import ATTITUDE_SETS
from rig.config.procedures.procedure_sections import MAX_SWEEP_S, AttitudesSection, SixSweepsSection
from rig.config.procedures.servo_procedure import RANGE_RATIO

SPEEDS_DEG_S = (15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 150.0)
ARCS_DEG = (90.0, 180.0, 270.0)  # arcs that are tried if the encoders' uncertainty is stated
TURNS_DEG = (360.0, 720.0, 1080.0)
OVERTRAVELS_DEG = (45.0, 90.0, 180.0)  # of a servo that are tried

# Family, angle in degrees, and keys of the procedure.
Motion = tuple[tuple[object, ...], float, Mapping[str, object]]


def vary_arm(config: RigConfig) -> Iterator[Motion]:
    """Yield sweeps about three or six axes, at one or two speeds, over turns or arcs.

    If the file states several speeds, the sweeps keep them.
    """
    procedure = config.procedure
    assert isinstance(procedure, SixSweepsSection)
    axes = (3, 6) if procedure.axes == 3 and not procedure.mountings else (procedure.axes,)
    possible = _speeds_deg_s(config)
    slowest_and_keys: list[tuple[float, Mapping[str, object]]] = [
        *((speed, {"speed_deg_s": speed, "speeds_deg_s": None}) for speed in possible),
        *((speed, {"speeds_deg_s": (speed, possible[-1])}) for speed in possible[:-1]),
    ]
    if procedure.speeds_deg_s is not None:
        slowest_and_keys = [(min(procedure.speeds_deg_s), {})]
    arcs = TURNS_DEG if config.uncertainty.angle_std_deg is None or config.magnetometers else (*ARCS_DEG, *TURNS_DEG)
    for count, (slowest, keys), arc_deg in product(axes, slowest_and_keys, arcs):
        if arc_deg / slowest <= MAX_SWEEP_S:
            family = (count, *keys.values(), arc_deg % 360 == 0)
            yield family, arc_deg, {**keys, "axes": count, "arc_deg": arc_deg}


def vary_attitudes(config: RigConfig) -> Iterator[Motion]:
    """Yield the file's attitudes and, unless there are magnetometers, the named sets of attitudes."""
    procedure = config.procedure
    assert isinstance(procedure, AttitudesSection)
    sets = [procedure.attitudes, *(() if config.magnetometers else ATTITUDE_SETS.values())]
    for attitudes in dict.fromkeys(sets):
        yield (attitudes,), 0.0, {"attitudes": attitudes}


def vary_imu(config: RigConfig) -> Iterator[Motion]:
    """Yield sweeps with attitudes. Sweeps have one speed and turn once, because gravity's effect recurs every turn."""
    turns = [motion for motion in vary_arm(config) if motion[1] == TURNS_DEG[0] and not motion[2].get("speeds_deg_s")]
    for (family, turned, keys), (attitudes, _, stood) in product(turns, vary_attitudes(config)):
        yield (*family, *attitudes), turned, {**keys, **stood}


def vary_servo(config: RigConfig) -> Iterator[Motion]:
    """Yield turns of a servo with different speeds and overtravels."""
    for speed_deg_s, overtravel_deg in product(_speeds_deg_s(config), OVERTRAVELS_DEG):
        yield (speed_deg_s,), overtravel_deg, {"speed_deg_s": speed_deg_s, "overtravel_deg": overtravel_deg}


def _speeds_deg_s(config: RigConfig) -> list[float]:
    fastest = min(sensor.range_deg_s for sensor in config.sensors.values()) / RANGE_RATIO
    return [speed for speed in SPEEDS_DEG_S if speed <= fastest]
