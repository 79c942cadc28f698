"""The duration of a whole procedure: `python benchmarks/laboratory/procedure.py [CONFIG]`.

Runs the configuration twice, at its own time scale and in real time. Prints the wall time of each command, and the
arm's time (first motion to last, by the controller's clock) relative to that of the planned motions and rests.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rig.config.load import load
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.data.recording.run_file import read_run
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.world.world_section import read_world_section

DEMO = Path(__file__).parents[2] / "configs" / "demo.yaml"


def measure(config: Path, time_scale: float, out: Path) -> tuple[float, float]:
    """Return the wall time of `rig run`, and the arm's time from its first motion to its last, s."""
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(out)]
    began_s = time.perf_counter()
    subprocess.run([*command, "--set", f"world.time_scale={time_scale}"], check=True, capture_output=True)
    wall_s = time.perf_counter() - began_s
    arm = read_run(out / "run.h5").states
    moving = np.flatnonzero(np.abs(arm["qd_rad_s"]).max(axis=1) > 0)
    return wall_s, float(arm["time_s"][moving[-1]] - arm["time_s"][moving[0]])


def main() -> None:
    config = Path(sys.argv[1]) if len(sys.argv) > 1 else DEMO
    loaded = load(config)
    if not loaded.simulated:
        sys.exit(f"{config} has no world: section; only a simulated procedure can be run here")
    assert isinstance(loaded.config.procedure, SixSweepsSection)
    planned_s = plan_six_observation(loaded.config.arm, loaded.config.procedure).duration_s
    print(f"planned motions and rests: {planned_s:.1f} s")
    with tempfile.TemporaryDirectory() as folder:
        for time_scale in (read_world_section(loaded).time_scale, 1.0):
            wall_s, arm_s = measure(config, time_scale, Path(folder) / f"{time_scale:g}")
            print(
                f"time_scale {time_scale:g}: command {wall_s:.1f} s, arm {arm_s:.1f} s, {arm_s / planned_s:.3f} of plan"
            )


if __name__ == "__main__":
    main()
