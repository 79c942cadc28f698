"""The six sweeps with one more check in the verdict: the item must not warm by more than 1 K in the run.

python examples/own_check.py CONFIG
"""

from collections.abc import Sequence
from dataclasses import replace

from procedures.six_observation import PROCEDURE as SIX_OBSERVATION
from rig.procedure import Outcome, RunData, calibrate, fitness, run_script

WARMING_MAX_K = 1.0


def analyse(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Return the usual outcome with a check of each gyroscope's temperature from its first sweep to its last."""
    outcome, temperatures_c = calibrate(runs, estimator), dict[str, list[float]]()
    for recording in outcome.recordings:
        for name, sensor in recording.sensors.items():
            temperatures_c.setdefault(name, []).extend(sweep.average.temperature_c for sweep in sensor.revolutions)
    warming_k = {name: max(values) - min(values) for name, values in temperatures_c.items()}
    checks = [fitness(name, "rate", "warming", value, WARMING_MAX_K, unit="K") for name, value in warming_k.items()]
    return replace(outcome, checks=(*outcome.checks, *checks))


PROCEDURE = replace(SIX_OBSERVATION, analyse=analyse)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
