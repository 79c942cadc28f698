"""The uncertainty that a session by hand will reach, before it is held: the session as a hand would make it. Pure.

The moves are those that are asked for, made evenly, and the sizes of what hands do are the stated ones: nothing is
found of a hand that has not moved yet.
"""

from collections.abc import Sequence

import numpy as np

from rig.config.hand_sections import ByHandSection
from rig.config.models import RigConfig
from rig.config.sensor_catalogue import PARTS
from rig.config.sensor_sections import SensorSection, mounting_matrix
from rig.config.stage_section import rotation_by
from rig.data.settings import ByHand, Uncertainty, by_hand_of, uncertainty_of
from rig.estimation.arrays import Array
from rig.estimation.budget import Budget
from rig.estimation.by_hand.fit import fit
from rig.estimation.by_hand.session import Handled, Move, Rest, Told, axis_of
from rig.estimation.by_hand.solution import solution_of
from rig.estimation.earth import MICRO_G_M_S2, STANDARD_GRAVITY_M_S2
from rig.motion.by_hand import Face, Instruction
from rig.observation.hand_runs import ITS_OWN_CLOCK, turned_face

FLIP_S, TURN_S = 1.5, 2.5  # a move, from rest to rest; assumed
ASKED_S = 1.0  # from the end of a rest to the next move: somebody reads what is asked for; assumed
SAMPLED_HZ = 60.0  # of the readings that are made up, with the noise density of the sensor's own
FIRST: Face = "+z"


def duration_s(moves: Sequence[Instruction], rest_s: float) -> float:
    """How long such a session takes an operator who makes no mistake."""
    return rest_s + sum(_move_s(each) + ASKED_S + rest_s for each in moves)


def predicted_by_hand(
    config: RigConfig, section: ByHandSection, moves: Sequence[Instruction], rest_s: float
) -> dict[str, Budget]:
    """The budget that a session of these moves will have, for each sensor to calibrate.

    `section` says how well the item's faces are made. Raises Fault `no_fit`.
    """
    known, said = uncertainty_of(config), by_hand_of(section)
    found = {}
    for name, sensor in config.to_calibrate.items():
        session = _session(sensor, moves, rest_s)
        found[name] = solution_of(fit(session, _told(sensor, known, said), trusted=0)).budget
    return found


def _told(sensor: SensorSection, known: Uncertainty, said: ByHand) -> Told:
    first = None if sensor.acceleration is not None else turned_face(FIRST, mounting_matrix(sensor.mounting))
    clock = "the board's crystal" if sensor.on_board else ITS_OWN_CLOCK
    return Told(known.crystal_ppm, clock, said.box_rad, first_face=first)


def _move_s(move: Instruction) -> float:
    return TURN_S * abs(move.turns) if move.turns else FLIP_S


def _session(sensor: SensorSection, moves: Sequence[Instruction], rest_s: float) -> Handled:
    """Rests of the wanted length, a little of it lost to the moves, and the moves between, in the sensor's axes."""
    mounting, part = mounting_matrix(sensor.mounting), PARTS[sensor.part]
    spans: list[tuple[float, Array | None]] = [(rest_s, None)]
    faces, last = [FIRST], FIRST
    for move in moves:
        spans += [(_move_s(move), _rotation(last, move)), (rest_s + ASKED_S, None)]
        last = move.face
        faces.append(last)
    ends_s = np.cumsum([lasting_s for lasting_s, _ in spans])
    time_s = np.arange(0.0, ends_s[-1], 1 / SAMPLED_HZ)
    rates, up = np.zeros((len(time_s), 3)), np.zeros((len(time_s), 3))
    rests: list[Rest] = []
    made: list[Move] = []
    for number, ((lasting_s, rotation), end_s) in enumerate(zip(spans, ends_s.tolist(), strict=True)):
        inside = (time_s >= end_s - lasting_s) & (time_s < end_s)
        face = axis_of(faces[number // 2])
        if rotation is None:
            up[inside] = face
            continue
        share = (time_s[inside] - (end_s - lasting_s)) / lasting_s
        rates[inside] = (1 - np.cos(2 * np.pi * share))[:, None] * rotation / lasting_s
        gone = share - np.sin(2 * np.pi * share) / (2 * np.pi)
        up[inside] = [rotation_by(-each * rotation) @ face for each in gone]
        made.append(Move(end_s - lasting_s, end_s, float(np.abs(rates[inside]).max())))
    rng = np.random.default_rng(len(moves))
    noise = part.angle_random_walk_rad_sqrt_s * SAMPLED_HZ**0.5
    rates = rates @ mounting.T + noise * rng.standard_normal(rates.shape)
    felt, felt_noise = STANDARD_GRAVITY_M_S2 * up @ mounting.T, 0.0
    if sensor.acceleration is not None:
        felt_noise = part.acceleration_noise_ug_sqrt_hz * MICRO_G_M_S2 * SAMPLED_HZ**0.5
        felt = felt + felt_noise * rng.standard_normal(felt.shape)
    for lasting_s, rest_end_s in (
        (each, end_s) for (each, way), end_s in zip(spans, ends_s, strict=True) if way is None
    ):
        inside = (time_s >= rest_end_s - lasting_s) & (time_s < rest_end_s)
        rests.append(
            Rest(
                float(rest_end_s - lasting_s),
                float(rest_end_s),
                int(inside.sum()),
                rates[inside].mean(axis=0),
                np.full(3, noise),
                felt[inside].mean(axis=0) if sensor.acceleration is not None else None,
                np.full(3, felt_noise) if sensor.acceleration is not None else None,
            )
        )
    return Handled(time_s, rates, felt if sensor.acceleration is not None else None, tuple(rests), tuple(made))


def _rotation(face: Face, move: Instruction) -> Array:
    """(3,) the rotation vector of a move in the item's axes, from a face up to the one that is asked for."""
    up, then = axis_of(face), axis_of(move.face)
    if move.turns:
        return 2 * np.pi * move.turns * up
    axis = np.cross(then, up)
    size = float(np.linalg.norm(axis))
    about: Array = np.eye(3)[(np.argmax(np.abs(up)) + 1) % 3] if size == 0.0 else axis / size
    turned: Array = np.arctan2(size, up @ then) * about
    return turned
