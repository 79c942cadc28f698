"""The calibration of a gyroscope from readings of a body turned by hand on a table. Pure functions."""

from rig.analysis.gyroscope.calibration import ALGORITHM_1, NEWTON, SensorResult
from rig.analysis.gyroscope.correction import Correction, matrix_correction
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.motion_file import Columns, Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault
from rig.estimation.by_hand import HandSolution, SessionConditions, solve_by_hand
from rig.estimation.by_hand.session_parts import FACES
from rig.observation.by_hand.hand_segmentation import segment_session
from rig.observation.external.csv_samples import Samples
from rig.observation.false_readings import check_frozen
from rig.observation.stuck_check import check_reads

NO_SWEEPS = Fault("too_few_observations", "moves by hand are not sweeps", "Give sweeps in six directions")


def solve_hand_samples(item: Item, samples: Samples, columns: Columns) -> SensorResult:
    """Return the gyroscope's calibration from the readings of a session; `columns` state its conditions.

    Raise Fault and Refused as `rig.estimation.by_hand.solve_by_hand` does; Fault `stuck_sensor`.
    """
    check_reads(samples.readings[RATE], RATE)
    check_frozen(samples.time_s, samples.readings[RATE])
    session = segment_session(samples.time_s, samples.readings[RATE], samples.readings.get(ACCELERATION))
    solution = solve_by_hand(session, read_conditions(columns))
    return build_hand_result(item, solution, matrix_correction(solution.turned))


def build_hand_result(sensor: RecordedSensor | Item, solution: HandSolution, corrected_by: Correction) -> SensorResult:
    """Return a session's result in the form of a gyroscope's result from sweeps."""
    return SensorResult(
        sensor=sensor,
        solution=solution.turned,
        vector_model=solution.turned,
        uncertainty=solution.budget,
        corrected_by=corrected_by,
        by_hand=solution,
        faults=dict.fromkeys((NEWTON, ALGORITHM_1), NO_SWEEPS),
    )


def read_conditions(columns: Columns) -> SessionConditions:
    """Return the conditions of a session from `columns`, the single row of its table of motion "turns"."""
    first = columns.get("first_face")
    return SessionConditions(
        clock_ppm=float(columns["clock_ppm"][0]),
        clock_source="as stated: --clock-ppm",
        box_rad=float(columns["box_rad"][0]),
        closure=bool(columns["closure"][0]),
        first_face=None if first is None else FACES[int(first[0])],
        gravity_m_s2=float(columns["gravity_m_s2"][0]),
    )
