"""The prediction of the uncertainty of a session by hand, from simulated readings. Pure functions.

The simulated moves follow the instructions exactly and smoothly. The fit weights them by the stated standard deviations
of a hand's errors.
"""

from collections.abc import Sequence

import numpy as np

from rig.config.models import RigConfig
from rig.config.procedures.hand_sections import ByHandSection
from rig.config.procedures.stage_section import rotation_by
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.recording.settings import HandSettings, Uncertainty, hand_settings, uncertainty_of
from rig.estimation.arrays import Array, axis_of
from rig.estimation.by_hand.fit import fit_session
from rig.estimation.by_hand.session_parts import HandRecording, SessionConditions
from rig.estimation.by_hand.solution import summarise_fit
from rig.estimation.earth import MICRO_G_M_S2, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import Budget
from rig.motion.by_hand import Face, Instruction
from rig.observation.by_hand.hand_segmentation import segment_session
from rig.observation.by_hand.rests_and_moves import OWN_CLOCK_SOURCE, rotate_face

FLIP_S, TURN_S = 1.5, 2.5  # duration of a move from rest to rest; assumed
INSTRUCTION_S = 1.0  # from the end of a rest to the next move: the operator reads the instruction; assumed
SAMPLE_RATE_HZ = 60.0  # of the simulated readings, which have the sensor's noise density
START_FACE: Face = "+z"


def duration_s(moves: Sequence[Instruction], rest_s: float) -> float:
    """Return the duration of a session by hand if the operator makes no mistakes."""
    return rest_s + sum(_move_s(move) + INSTRUCTION_S + rest_s for move in moves)


def predict_hand_budgets(
    config: RigConfig, section: ByHandSection, moves: Sequence[Instruction], rest_s: float
) -> dict[str, Budget]:
    """Return the predicted budget of each sensor to calibrate, for a session with the given moves.

    `section` states how square the item's faces are; `rest_s` is the duration of a rest. Raise Fault `no_fit`.
    """
    uncertainty, section_values = uncertainty_of(config), hand_settings(section)
    budgets = {}
    for name, sensor in config.to_calibrate.items():
        session = _session(sensor, moves, rest_s)
        budgets[name] = summarise_fit(
            fit_session(session, _conditions(sensor, uncertainty, section_values), trusted=0)
        ).budget
    return budgets


def _conditions(sensor: SensorSection, uncertainty: Uncertainty, procedure: HandSettings) -> SessionConditions:
    first = None if sensor.acceleration is not None else rotate_face(START_FACE, mounting_matrix(sensor.mounting))
    clock = "the board's crystal" if sensor.on_board else OWN_CLOCK_SOURCE
    return SessionConditions(uncertainty.crystal_ppm, clock, procedure.box_rad, first_face=first)


def _move_s(move: Instruction) -> float:
    return TURN_S * abs(move.turns) if move.turns else FLIP_S


def _session(sensor: SensorSection, moves: Sequence[Instruction], rest_s: float) -> HandRecording:
    """Return the simulated readings of a session in the sensor's axes, segmented into rests and moves."""
    no_rotation, faces = np.zeros(3), [START_FACE, *(move.face for move in moves)]
    spans = [_sample_rotation(rest_s, START_FACE, no_rotation)]
    for face, move in zip(faces, moves, strict=False):
        spans += [
            _sample_rotation(_move_s(move), face, _rotation(face, move)),
            _sample_rotation(rest_s + INSTRUCTION_S, move.face, no_rotation),
        ]
    turning_rad_s, up = (np.concatenate(part_of_span) for part_of_span in zip(*spans, strict=True))
    part, mounting, rng = PARTS[sensor.part], mounting_matrix(sensor.mounting), np.random.default_rng(len(moves))

    def read(true: Array, noise_sqrt_hz: float) -> Array:
        readings: Array = true @ mounting.T + noise_sqrt_hz * SAMPLE_RATE_HZ**0.5 * rng.standard_normal(true.shape)
        return readings

    rates, acceleration = read(turning_rad_s, part.angle_random_walk_rad_sqrt_s), None
    if sensor.acceleration is not None:
        acceleration = read(STANDARD_GRAVITY_M_S2 * up, part.velocity_random_walk_ug_sqrt_s * MICRO_G_M_S2)
    return segment_session(np.arange(len(rates)) / SAMPLE_RATE_HZ, rates, acceleration)


def _sample_rotation(lasting_s: float, face: Face, rotation: Array) -> tuple[Array, Array]:
    """Return the rates (n, 3) and the vertical (n, 3), in the item's axes, during a smooth rotation.

    At its start, `face` is up; `rotation` is the rotation vector (3,), zero for a rest.
    """
    count = round(lasting_s * SAMPLE_RATE_HZ)
    fraction, up = (np.arange(count) + 0.5) / count, np.tile(axis_of(face), (count, 1))
    if rotation.any():
        progress = fraction - np.sin(2 * np.pi * fraction) / (2 * np.pi)
        up = np.array([rotation_by(-turned * rotation) @ axis_of(face) for turned in progress])
    return (1 - np.cos(2 * np.pi * fraction))[:, None] * rotation / lasting_s, up


def _rotation(face: Face, move: Instruction) -> Array:
    """Return the rotation vector (3,), in the item's axes, of a move at whose start `face` is up."""
    up, target = axis_of(face), axis_of(move.face)
    if move.turns:
        return 2 * np.pi * move.turns * up
    axis = np.cross(target, up)
    size = float(np.linalg.norm(axis))
    about: Array = np.eye(3)[(np.argmax(np.abs(up)) + 1) % 3] if size == 0.0 else axis / size
    rotation: Array = np.arctan2(size, up @ target) * about
    return rotation
