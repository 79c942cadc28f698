"""Dwells on an arm, with an inclinometer next to its sensors: python -m support.extensions.inclined_run FOLDER."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from rig.data.recording.channel import Channel
from rig.data.recording.layout import Contents, lay_out
from rig.data.recording.layout_keys import EVENTS_DTYPE, SCHEMA
from rig.data.recording.recorded_events import encode_event
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.observation.observed_run import observe_run
from rig.observation.windows import dwelt
from rig.plans.recorded_run import open_run
from support.extensions.inclinometer import INCLINATION
from support.paths import RECORDINGS

SCALE, BIAS_RAD, PER_COUNT, NOISE_RAD = np.array([1.02, 0.97]), np.array([0.004, -0.007]), 1e-5, 2e-4


def write(folder: Path) -> None:
    """Write the frozen recording's samples, and those of an inclinometer by the board's clock."""
    run = open_run(RECORDINGS / "imu").movement[0]
    observed = observe_run(run, run.settings.observation)
    tilt = RecordedSensor("tilt2", "I-1", 100.0, (Channel(INCLINATION.name, "tilt", "<i4", PER_COUNT, 0.0, 10**6),))
    gyro_samples = run.samples["gyro"]
    samples = np.zeros(len(gyro_samples), tilt.sample_dtype)
    for name in ("sequence", "board_time_us", "host_time_s"):
        samples[name] = gyro_samples[name]
    time_s, noise = observed.time_s("gyro"), np.random.default_rng(4)
    for dwell in dwelt(run):
        inside = (time_s >= dwell.window.start_s) & (time_s <= dwell.window.end_s)
        up = observed.motion.attitude(dwell.window.start_s, dwell.window.end_s) @ [0, 0, 1]
        readings = np.arcsin(up[:2]) / SCALE + BIAS_RAD + noise.normal(0, NOISE_RAD, (int(inside.sum()), 2))
        samples["tilt"][inside] = np.round(readings / PER_COUNT)
    sensors = {**run.sensors, "tilt": tilt}
    recorded = replace(run, sensors=sensors, samples={**run.samples, "tilt": samples})
    texts = {"config": run.config, "settings": run.settings.to_json()}
    texts["provenance"] = json.dumps(run.provenance.document())
    assert run.turner is not None
    texts["turner"] = run.turner.to_json()
    events = np.frombuffer(b"".join(map(encode_event, run.events)), EVENTS_DTYPE)
    described = {name: sensor.attributes() for name, sensor in sensors.items()}
    lay_out(folder / "run.h5", Contents(SCHEMA, texts, described, recorded.samples, run.states, events), swmr=False)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
