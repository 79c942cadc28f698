"""What counts of an interrupted run: sound sweeps that the board knows and that do not contradict one another."""

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from firmware_host.answers import BoardObservation
from rig.analysis.analyses import calibrate
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.recording.recorded_events import BoardObserved, TimedEvent
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.errors import Refused
from rig.observation.windows import swept
from rig.plans.script_file import ScriptFile, find_installed_script
from rig.runner.resumption import resumption
from support.laboratories.commands import configuration, rig
from support.recordings import damaged_accelerations
from support.recordings.damaged_readings import offset, readings_of, replace_readings
from support.recordings.synthetic_run import Setup

pytestmark = pytest.mark.slow

SCRIPT = find_installed_script("six_observation")
SETUP = Setup(noise_rad_s=0.005)


def known_to_the_board(run: RunData) -> RunData:
    seen = [
        BoardObserved("gyro", sweep.sweep.index, float(np.radians(60)), BoardObservation(0, 0, 1, 1, (0.0, 0.0, 0.0)))
        for sweep in swept(run)
    ]
    return replace(
        run,
        events=(*run.events, *(TimedEvent(event, 0.0, 0.0) for event in seen)),
        provenance=replace(run.provenance, script_sha256=SCRIPT.sha256),
    )


def test_sweeps_that_agree_count() -> None:
    run = known_to_the_board(readings_of(SETUP).recording())
    assert resumption([run], run.settings, SCRIPT).done == set(range(6))


def test_other_limits_than_those_of_the_recording_are_refused_by_name() -> None:
    """The verdict is that of the first recording's limits: stricter ones in config.yaml would not be used."""
    run = known_to_the_board(readings_of(SETUP).recording())
    assert run.settings.limits is not None
    stricter = run.settings.limits.model_copy(update={"scale_std": 1e-9})
    site = replace(run.settings.site, gravity_m_s2=9.79)
    with pytest.raises(Refused, match=r"another_setting: .*: limits, site;"):
        resumption([run], replace(run.settings, limits=stricter, site=site), SCRIPT)
    assert resumption([run], replace(run.settings, stage=1), SCRIPT).earlier


@pytest.mark.thorough
def test_a_sweep_that_contradicts_the_others_is_repeated() -> None:
    """And the one about the same axis the other way, for which of the two was disturbed nobody can tell."""
    damaged = offset(0.02, lambda seen: seen.sweep(4))(readings_of(SETUP))
    run = known_to_the_board(damaged.recording())
    assert resumption([run], run.settings, SCRIPT).done == {0, 1, 2, 3}


@pytest.mark.thorough
def test_a_sweep_that_only_the_accelerometer_contradicts_is_repeated() -> None:
    sound = damaged_accelerations.readings_of("imu", "gyro")
    damaged = damaged_accelerations.offset(0.02, lambda seen: seen.sweep(4))(sound)
    script = find_installed_script("imu")
    before, run = (by_script(each.recording(), script) for each in (sound, damaged))
    done = resumption([before], run.settings, script).done
    assert 4 in done and resumption([run], run.settings, script).done == done - {4}


def by_script(run: RunData, script: ScriptFile) -> RunData:
    return replace(run, provenance=replace(run.provenance, script_sha256=script.sha256))


def test_a_sweep_with_a_spike_is_repeated() -> None:
    """One wrong reading of hundreds changes the mean by little, but the verdict would fail by it."""
    seen = readings_of(SETUP)
    worst = seen.counts.copy()
    worst[np.flatnonzero(seen.sweep(2))[300]] += 20_000
    assert resumption([known_to_the_board(seen.reading(worst).recording())], seen.run.settings, SCRIPT).done == {
        0,
        1,
        3,
        4,
        5,
    }


def test_nothing_counts_of_a_recording_whose_clock_was_set() -> None:
    """None of its sweeps could be put on one clock with the board's readings."""
    run = known_to_the_board(readings_of(SETUP).recording())
    states = run.states.copy()
    states["time_s"][len(states) // 2 :] -= 0.5
    assert resumption([replace(run, states=states)], run.settings, SCRIPT).done == frozenset()


def test_what_was_repeated_counts_in_its_place() -> None:
    damaged = known_to_the_board(offset(0.02, lambda seen: seen.sweep(4))(readings_of(SETUP)).recording())
    again = known_to_the_board(readings_of(replace(SETUP, seed=2)).recording())
    again = replace(again, provenance=replace(again.provenance, started_utc="2026-11-21T00:10:00+00:00"))
    assert resumption([damaged, again], damaged.settings, SCRIPT).done == set(range(6))


def test_what_was_read_at_rest_beside_a_repeated_sweep_does_not_count() -> None:
    """A bad contact in the rest before sweep 4: the run ended there, and went on with sweep 4 when it was mended."""
    seen = readings_of(SETUP)
    bad = replace_readings(lambda seen: seen.rest(3) & seen.some(0.1), 20_000)(seen).recording()
    assert "gyro.spikes" in failed([bad])
    begun_s = next(sweep.window.start_s for sweep in swept(seen.run) if sweep.sweep.index == 4)
    other = readings_of(replace(SETUP, seed=2)).recording()
    later = replace(other.provenance, started_utc="2026-11-21T00:10:00+00:00")
    assert failed([part(bad, 0.0, begun_s), replace(part(other, begun_s, np.inf), provenance=later)]) == set()


def failed(runs: list[RunData]) -> set[str]:
    """The checks that failed but those of what the board solved, which these recordings tell nothing of."""
    return {check.name for check in calibrate(runs).checks if not check.passed and "board" not in check.name}


def part(run: RunData, from_s: float, to_s: float) -> RunData:
    """What a recording tells of that time: its events. Readings and states are all there."""
    inside = (event for event in run.events if from_s <= (event.controller_time_s or 0.0) < to_s)
    return replace(run, events=tuple(inside))


@pytest.mark.thorough
def test_a_finished_run_repeats_the_sweep_that_its_verdict_named(tmp_path: Path) -> None:
    """Something moved the bench during sweep 4: the recording shows it, and the verdict named it."""
    out = tmp_path / "run"
    config = configuration(tmp_path, {"procedure": {"rest_s": 1.0}})
    begun = rig("run", config, "--out", out)
    assert begun.returncode == 0, begun.stderr + begun.stdout
    assert "already_finished" in rig("resume", out).stderr
    (observed,) = observe_recordings([read_run(out / "run.h5")])
    seen = observed.sensors["gyro"]
    turn = seen.revolutions[4].average
    with h5py.File(out / "run.h5", "r+") as file:
        samples = file["samples/gyro"][:]
        time_s = seen.time_base.controller_time_s(samples["board_time_us"] * 1e-6)
        samples["counts"][(time_s > turn.start_s) & (time_s < turn.end_s), 0] += 300
        file["samples/gyro"][:] = samples
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    named = {**result["checks"][-1], "name": "gyro.disturbed_sweep.4", "sweep": 4, "passed": False}
    (out / "result.json").write_text(json.dumps({**result, "verdict": "fail", "checks": [*result["checks"], named]}))

    resumed = rig("resume", out)
    assert resumed.returncode == 0, resumed.stderr + resumed.stdout
    assert resumed.stderr.count("done: sweep") == 2  # which of the two about one axis it was nobody can tell
    repeated = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert repeated["verdict"] == "pass" and len(repeated["gyroscopes"]["gyro"]["observations"]) == 6
