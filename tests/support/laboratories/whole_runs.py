"""Runs of `rig run` with a configuration of their own, and their stated results."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.recording.run_file import read_run
from rig.observation.observed_run import ObservedRun
from support.laboratories.commands import rig
from support.laboratories.drawn_laboratory import truth
from support.laboratories.worlds import fresh_host


@dataclass(frozen=True, slots=True)
class WholeRun:
    """A run that passed: its configuration, its recording observed again, and its result.json."""

    document: dict[str, Any]
    observed: ObservedRun
    result: dict[str, Any]

    def stated(self, sensor: str) -> np.ndarray:
        """Return scale and bias (6,)."""
        entry = self.result["gyroscopes"][sensor]
        return np.array(entry["scale"] + entry["bias_rad_s"])

    def stated_std(self, sensor: str) -> np.ndarray:
        """Return their combined standard uncertainties (6,)."""
        return np.asarray(np.sqrt(np.diag(self.result["gyroscopes"][sensor]["covariance_combined"])))

    def truth(self, sensor: str, speed_rad_s: float) -> np.ndarray:
        """Return the true scale and bias (6,) over the times of this run's averages, the scale at that speed."""
        recorded = self.observed.sensors[sensor]
        averages = [*(turn.average for turn in recorded.revolutions), *recorded.rests]
        from_s, to_s = min(a.start_s for a in averages), max(a.end_s for a in averages)
        return truth(self.document, sensor, [(from_s, to_s)], speed_rad_s)


def whole_run(document: dict[str, Any], folder: Path) -> WholeRun:
    """Run in `folder`, which is created, on an address of its own."""
    host = fresh_host()
    document["arm"]["host"], document["board"]["port"] = host, f"socket://{host}:7321"
    folder.mkdir()
    config, out = folder / "config.yaml", folder / "run"
    config.write_text(yaml.safe_dump(document), encoding="utf-8")
    done = rig("run", config, "--out", out)
    assert done.returncode == 0, done.stderr + done.stdout
    (observed,) = observe_recordings([read_run(out / "run.h5")])
    return WholeRun(document, observed, json.loads((out / "result.json").read_text(encoding="utf-8")))
