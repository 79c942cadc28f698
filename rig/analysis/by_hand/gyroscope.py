"""A gyroscope that a hand turned on a table: what its readings alone tell. Pure."""

from rig.analysis.gyroscope.calibration import ALGORITHM_1, NEWTON, SensorResult
from rig.analysis.gyroscope.correction import Correction, matrix_correction
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.motion_file import Columns, Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault
from rig.estimation.by_hand import HandSolution, SessionConditions, solve_by_hand
from rig.estimation.by_hand.session import FACES
from rig.observation.by_hand.handled import handled
from rig.observation.external.csv_samples import Samples
from rig.observation.stuck_check import check_reads

NO_SWEEPS = Fault("too_few_observations", "moves by hand are no sweeps", "Give sweeps in six directions")


def solved_by_hand(item: Item, samples: Samples, told: Columns) -> SensorResult:
    """The gyroscope of readings, by what somebody `told` of the session (`told_of`).

    Raises Fault and Refused as `rig.estimation.by_hand.solve_by_hand`, and `stuck_sensor`.
    """
    check_reads(samples.readings[RATE], RATE)
    session = handled(samples.time_s, samples.readings[RATE], samples.readings.get(ACCELERATION))
    solution = solve_by_hand(session, told_of(told))
    return result_by_hand(item, solution, matrix_correction(solution.turned))


def result_by_hand(sensor: RecordedSensor | Item, solution: HandSolution, corrected_by: Correction) -> SensorResult:
    """The gyroscope as one that was swept is described."""
    return SensorResult(
        sensor=sensor,
        solution=solution.turned,
        vector_model=solution.turned,
        explained=None,
        uncertainty=solution.budget,
        six_observation=None,
        algorithm_1=None,
        observations=(),
        rests=(),
        time_bases=(),
        corrected_by=corrected_by,
        by_hand=solution,
        faults=dict.fromkeys((NEWTON, ALGORITHM_1), NO_SWEEPS),
    )


def told_of(columns: Columns) -> SessionConditions:
    """What the one row of a table of "turns" says (`rig.data.recording.motion_file`)."""
    first = columns.get("first_face")
    return SessionConditions(
        clock_ppm=float(columns["clock_ppm"][0]),
        clock_source="as stated: --clock-ppm",
        box_rad=float(columns["box_rad"][0]),
        closure=bool(columns["closure"][0]),
        first_face=None if first is None else FACES[int(first[0])],
        gravity_m_s2=float(columns["gravity_m_s2"][0]),
    )
