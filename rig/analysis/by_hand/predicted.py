"""The uncertainty that a session by hand will reach, before it is held: the session as a hand would make it. Pure.

The moves are those that are asked for, made evenly, and the sizes of what hands do are the stated ones: nothing is
found of a hand that has not moved yet.
"""

from collections.abc import Sequence

import numpy as np

from rig.config.models import RigConfig
from rig.config.procedures.hand_sections import ByHandSection
from rig.config.procedures.stage_section import rotation_by
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.recording.settings import ByHand, Uncertainty, by_hand_of, uncertainty_of
from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import fit_session
from rig.estimation.by_hand.session import HandRecording, SessionConditions, axis_of
from rig.estimation.by_hand.solution import summarise_fit
from rig.estimation.earth import MICRO_G_M_S2, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import Budget
from rig.motion.by_hand import Face, Instruction
from rig.observation.by_hand.handled import handled
from rig.observation.by_hand.runs import ITS_OWN_CLOCK, turned_face

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
        found[name] = summarise_fit(fit_session(session, _told(sensor, known, said), trusted=0)).budget
    return found


def _told(sensor: SensorSection, known: Uncertainty, procedure: ByHand) -> SessionConditions:
    first = None if sensor.acceleration is not None else turned_face(FIRST, mounting_matrix(sensor.mounting))
    clock = "the board's crystal" if sensor.on_board else ITS_OWN_CLOCK
    return SessionConditions(known.crystal_ppm, clock, procedure.box_rad, first_face=first)


def _move_s(move: Instruction) -> float:
    return TURN_S * abs(move.turns) if move.turns else FLIP_S


def _session(sensor: SensorSection, moves: Sequence[Instruction], rest_s: float) -> HandRecording:
    """The readings of such a session in the sensor's axes, cut into rests and moves as a recording is."""
    still, faces = np.zeros(3), [FIRST, *(move.face for move in moves)]
    spans = [_turning(rest_s, FIRST, still)]
    for face, move in zip(faces, moves, strict=False):
        spans += [_turning(_move_s(move), face, _rotation(face, move)), _turning(rest_s + ASKED_S, move.face, still)]
    turning_rad_s, up = (np.concatenate(each) for each in zip(*spans, strict=True))
    part, mounting, rng = PARTS[sensor.part], mounting_matrix(sensor.mounting), np.random.default_rng(len(moves))

    def read(true: Array, noise_sqrt_hz: float) -> Array:
        readings: Array = true @ mounting.T + noise_sqrt_hz * SAMPLED_HZ**0.5 * rng.standard_normal(true.shape)
        return readings

    rates, felt = read(turning_rad_s, part.angle_random_walk_rad_sqrt_s), None
    if sensor.acceleration is not None:
        felt = read(STANDARD_GRAVITY_M_S2 * up, part.acceleration_noise_ug_sqrt_hz * MICRO_G_M_S2)
    return handled(np.arange(len(rates)) / SAMPLED_HZ, rates, felt)


def _turning(lasting_s: float, face: Face, rotation: Array) -> tuple[Array, Array]:
    """(n, 3) rates of the item and (n, 3) what is up, in its axes, while a rotation vector turns it from a face."""
    count = round(lasting_s * SAMPLED_HZ)
    share, up = (np.arange(count) + 0.5) / count, np.tile(axis_of(face), (count, 1))
    if rotation.any():
        gone = share - np.sin(2 * np.pi * share) / (2 * np.pi)
        up = np.array([rotation_by(-each * rotation) @ axis_of(face) for each in gone])
    return (1 - np.cos(2 * np.pi * share))[:, None] * rotation / lasting_s, up


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
