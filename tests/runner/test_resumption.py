"""What counts of an interrupted run: sound sweeps that the board knows and that do not contradict one another."""

from dataclasses import replace

import numpy as np

from firmware_host.answers import BoardObservation
from rig.data.events import BoardObserved, Recorded
from rig.data.run_file import RunData
from rig.observation.windows import swept
from rig.plans.script_file import installed_script
from rig.runner.resumption import resumption
from support.damaged_readings import offset, readings_of
from support.synthetic_run import Setup

SCRIPT = installed_script("six_observation")
SETUP = Setup(noise_rad_s=0.005)


def known_to_the_board(run: RunData) -> RunData:
    seen = [
        BoardObserved("gyro", each.sweep.index, float(np.radians(60)), BoardObservation(0, 0, 1, 1, (0.0, 0.0, 0.0)))
        for each in swept(run)
    ]
    return replace(
        run,
        events=(*run.events, *(Recorded(event, 0.0, 0.0) for event in seen)),
        provenance=replace(run.provenance, script_sha256=SCRIPT.sha256),
    )


def test_sweeps_that_agree_count() -> None:
    run = known_to_the_board(readings_of(SETUP).recording())
    assert resumption([run], run.settings, SCRIPT).done == set(range(6))


def test_a_sweep_that_contradicts_the_others_is_repeated() -> None:
    """And the one about the same axis the other way, for which of the two was disturbed nobody can tell."""
    damaged = offset(0.02, lambda seen: seen.sweep(4))(readings_of(SETUP))
    run = known_to_the_board(damaged.recording())
    assert resumption([run], run.settings, SCRIPT).done == {0, 1, 2, 3}


def test_what_was_repeated_counts_in_its_place() -> None:
    damaged = known_to_the_board(offset(0.02, lambda seen: seen.sweep(4))(readings_of(SETUP)).recording())
    again = known_to_the_board(readings_of(replace(SETUP, seed=2)).recording())
    again = replace(again, provenance=replace(again.provenance, started_utc="2026-11-21T00:10:00+00:00"))
    assert resumption([damaged, again], damaged.settings, SCRIPT).done == set(range(6))
