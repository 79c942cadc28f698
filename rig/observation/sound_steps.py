"""The sweeps and dwells of a recording that a resumed run need not repeat."""

import numpy as np

from rig.data.quantity import RATE
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import MAD_TO_STD
from rig.observation.arm_rests import average_rests
from rig.observation.average import Stream, slice_time, synchronize_stream
from rig.observation.finished_steps import complete_dwells, complete_sweeps
from rig.observation.motion.arm_motion import ArmMotion, motion_of
from rig.observation.observe import check_response, observe_each_sweep
from rig.observation.reference.dwell_acceleration import read_each_dwell
from rig.observation.windows import Window

SPIKE_STDS = 8.0  # normal noise exceeds it once in 1e15 readings


def sound_sweeps(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """Return the finished sweeps that `observe_sensor` accepts for every sensor and that contain no spike."""
    return complete_sweeps(run) & _find_sound_steps(run, settings)


def sound_dwells(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    """Return the finished dwells that are accepted for every sensor and that contain no spike."""
    return complete_dwells(run) & _find_sound_steps(run, settings)


def _find_sound_steps(run: RunData, settings: ObservationThresholds) -> frozenset[int]:
    try:
        motion = motion_of(run)
    except Fault:
        return frozenset()
    sound = (_find_sound_steps_of(run, sensor, motion, settings) for sensor in run.measuring(RATE))
    return frozenset.intersection(*sound)


def _find_sound_steps_of(
    run: RunData, sensor: str, motion: ArmMotion, settings: ObservationThresholds
) -> frozenset[int]:
    """Return one sensor's sweeps and dwells that have no fault.

    Return no step if the sensor ever failed to follow the arm, because it is unknown when the fault began.
    """
    try:
        stream = synchronize_stream(run.samples[sensor], run.sensors[sensor], motion)
        dwells = read_each_dwell(run, stream, motion, settings)
        rests = average_rests(run, stream, motion, np.array(stream.sensor.mounting))
        check_response(run, rests, list(dwells.results.values()))
    except Fault:
        return frozenset()
    sweeps = observe_each_sweep(run, stream, motion, settings)
    windows = {index: dwell.window for index, dwell in dwells.results.items()}
    for index, turn in sweeps.results.items():
        windows[index] = Window(turn.average.start_s, turn.average.end_s)
    spiky = {index for index, window in windows.items() if _has_spike(stream, window)}
    return (complete_sweeps(run) | complete_dwells(run)).difference(sweeps.faults, dwells.faults, spiky)


def _has_spike(stream: Stream, window: Window) -> bool:
    """Return whether a window of a sweep or dwell has a spike, which fails the verdict even if the mean is right."""
    inside = slice_time(stream, window.start_s, window.end_s)
    counts = stream.sensor.channel(RATE).counts(stream.raw)[inside].astype(np.float64)
    if not len(counts):
        return False
    deviation = np.abs(counts - np.median(counts, axis=0))
    return bool(np.any(deviation > SPIKE_STDS * np.maximum(MAD_TO_STD * np.median(deviation, axis=0), 0.5)))
