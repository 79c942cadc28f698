"""A turntable's run with a gyroscope, as the runner records it: `python -m support.extensions.turned_run DIR`."""

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from rig.commands.configured import load_configured
from rig.data.recording.provenance import provenance_of
from rig.data.recording.recorded_events import RestFinished, RestStarted, SweepFinished, SweepStarted
from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_file import RunRecorder
from rig.data.recording.settings import settings_of
from rig.data.run_folder import CONFIG
from rig.motion.steps import Dwell, Rest, Sweep
from rig.motion.turner_state import State
from rig.turners.turner_registry import kind_of
from support.recordings.synthetic_run import SENSITIVITY, SENSOR

TEXT = """
turner: {kind: turntable, serial_port: /dev/ttyUSB7}
board: {port: /dev/ttyACM0}
sensors: {gyro: {part: lsm9ds1, serial_number: LSM9DS1-001}}
procedure: {name: one_axis}
limits: {scale_deviation: 0.3, scale_std: 0.002, bias_rad_s: 0.1, bias_std_rad_s: 0.002, condition: 100}
"""
BIAS_RAD_S = np.array([0.01, -0.02, 0.005])


def write(folder: Path) -> None:
    """Write the run folder, with everything that is recorded during a run."""
    (folder / CONFIG).write_text(TEXT, encoding="utf-8")
    loaded = load_configured(folder / CONFIG)
    config, plan = loaded.loaded.config, loaded.phase.plan()
    kind = kind_of(config.turner)
    report = kind.look(config.turner)
    turner = kind.describe_connected(config.turner, report)
    recorder = RunRecorder(
        folder / "run.h5",
        config=loaded.loaded.rig_text,
        settings=settings_of(config, plan),
        provenance=provenance_of(
            loaded.loaded,
            None,
            report,
            turner,
            stored={},
            script=loaded.script.identity,
            script_installed=True,
            follows_crystal=None,
            kind=kind.name,
        ),
        turner=RecordedTurner.build(kind.name, turner, report.joints, kind.fields),
        sensors={"gyro": SENSOR},
    )
    states: list[State] = []
    with recorder, kind.connect(config.turner, states.append, folder / "client.log") as table:
        assert kind.problems([plan], config.turner, table.report()) == []
        table.take_control(kind.carried(config.turner))
        table.rest(1.0)
        for step in plan.steps:
            match step:
                case Rest():
                    recorder.add(RestStarted(), controller_time_s=table.latest.time_s)
                    table.rest(step.duration_s)
                    recorder.add(RestFinished(), controller_time_s=table.latest.time_s)
                case Sweep():
                    recorder.add(SweepStarted(step), controller_time_s=table.latest.time_s)
                    table.move(step)
                    recorder.add(SweepFinished(step), controller_time_s=table.latest.time_s)
                case Dwell():
                    raise AssertionError("a turntable has no attitudes")
                case _:
                    table.move(step)
        table.rest(1.0)
        for state in states:
            recorder.add_state(state)
        recorder.add_samples("gyro", _samples(states))


def _samples(states: list[State]) -> np.ndarray:
    """Return readings about the table's axis z, by a clock that began 97 s after the table's."""
    turned = CubicSpline([state.time_s for state in states], [state.q_rad[0] for state in states])
    time_s = np.arange(states[0].time_s + 0.3, states[-1].time_s - 0.3, 1 / SENSOR.rate_hz)
    rate = np.column_stack([np.zeros((len(time_s), 2)), turned(time_s, 1)])
    noise = np.random.default_rng(5).normal(0, 1e-3, rate.shape)
    samples = np.zeros(len(time_s), SENSOR.sample_dtype)
    samples["sequence"] = np.arange(len(time_s))
    samples["board_time_us"] = np.round((time_s - 97.0) * 1e6)
    samples["host_time_s"] = time_s + 1e4
    samples["counts"] = np.round((rate - BIAS_RAD_S + noise) / SENSITIVITY)
    return samples


if __name__ == "__main__":
    write(Path(sys.argv[1]))
