"""What of a recording counts when its run is resumed: what every sensor has recorded soundly."""

from rig.data.run_file import RunData
from rig.data.settings import ObservationThresholds
from rig.errors import Fault
from rig.observation.acceleration import DwellReading, each_dwell
from rig.observation.average import on_the_arms_clock
from rig.observation.observe import check_feeling, each_sweep, rests_of
from rig.observation.timebase import ArmMotion
from rig.observation.windows import finished_dwells, finished_sweeps


def sound_sweeps(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """The finished sweeps that `observe_sensor` accepts for every sensor: a resumed run need not repeat them."""
    return finished_sweeps(run) & _sound(run, settings)


def sound_dwells(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """The same of the dwells."""
    return finished_dwells(run) & _sound(run, settings)


def _sound(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    try:
        motion = ArmMotion(run.arm, run.provenance.kinematics)
    except Fault:
        return frozenset()
    sound = (_sound_for(run, sensor, motion, settings) for sensor in run.sensors)
    return frozenset.intersection(*sound)


def _sound_for(run: RunData, sensor: str, motion: ArmMotion, settings: ObservationThresholds) -> frozenset[int]:
    """Nothing of a sensor that once did not feel what the arm did: when it began nobody knows."""
    try:
        stream = on_the_arms_clock(run.samples[sensor], run.sensors[sensor], motion)
        readings = each_dwell(run, stream, motion, settings)
        dwells = [each for each in readings.values() if isinstance(each, DwellReading)]
        check_feeling(run, rests_of(run, stream, motion), dwells)
    except Fault:
        return frozenset()
    found = {**each_sweep(run, stream, motion, settings), **readings}
    refused = {index for index, each in found.items() if isinstance(each, Fault)}
    return (finished_sweeps(run) | finished_dwells(run)) - refused
