"""What of a recording counts when its run is resumed: what every sensor has recorded soundly."""

import numpy as np

from rig.data.quantity import RATE
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.observation.arm_rests import rests_of
from rig.observation.average import Stream, between, on_the_arms_clock
from rig.observation.finished import finished_dwells, finished_sweeps
from rig.observation.motion.arm_motion import ArmMotion, motion_of
from rig.observation.observe import check_feeling, observe_each_sweep
from rig.observation.reference.acceleration import read_each_dwell
from rig.observation.windows import Window

SPIKE = 8.0  # of the readings' own deviation: one reading in 1e15


def sound_sweeps(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """The finished sweeps that `observe_sensor` accepts for every sensor, and in which no reading is a spike: a resumed
    run need not repeat them."""
    return finished_sweeps(run) & _sound(run, settings)


def sound_dwells(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """The finished dwells that are accepted for every sensor, and in which no reading is a spike."""
    return finished_dwells(run) & _sound(run, settings)


def _sound(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    try:
        motion = motion_of(run)
    except Fault:
        return frozenset()
    sound = (_sound_for(run, sensor, motion, settings) for sensor in run.measuring(RATE))
    return frozenset.intersection(*sound)


def _sound_for(run: RunData, sensor: str, motion: ArmMotion, settings: ObservationThresholds) -> frozenset[int]:
    """Sweeps and dwells that a sensor read soundly: none if it once did not feel the arm; since when nobody knows."""
    try:
        stream = on_the_arms_clock(run.samples[sensor], run.sensors[sensor], motion)
        dwells = read_each_dwell(run, stream, motion, settings)
        rests = rests_of(run, stream, motion, np.array(stream.sensor.mounting))
        check_feeling(run, rests, list(dwells.results.values()))
    except Fault:
        return frozenset()
    sweeps = observe_each_sweep(run, stream, motion, settings)
    windows = {index: dwell.window for index, dwell in dwells.results.items()}
    for index, turn in sweeps.results.items():
        windows[index] = Window(turn.average.start_s, turn.average.end_s)
    spiky = {index for index, window in windows.items() if _spiky(stream, window)}
    return (finished_sweeps(run) | finished_dwells(run)).difference(sweeps.faults, dwells.faults, spiky)


def _spiky(stream: Stream, window: Window) -> bool:
    """Whether a reading at a constant rate is a spike: the verdict would fail by it, whatever the mean."""
    inside = between(stream, window.start_s, window.end_s)
    counts = stream.sensor.channel(RATE).counts(stream.raw)[inside].astype(np.float64)
    if not len(counts):
        return False
    off = np.abs(counts - np.median(counts, axis=0))
    return bool(np.any(off > SPIKE * np.maximum(1.4826 * np.median(off, axis=0), 0.5)))
