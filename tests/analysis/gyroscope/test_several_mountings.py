"""One calibration from several mountings of the item, each a little off: the mounts are found, the scale stays."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import solve_observed
from rig.analysis.gyroscope.stage_mounts import EstimatedMount, observe_as_mounted
from rig.data.recording.settings import settings_from_json
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from support.recordings.drawn_recording import KINDS
from support.recordings.drawn_stages import drawn_stages, stage_setup
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

SEEDS, FEW = range(20), range(2)
KIND = KINDS["quiet LSM9DS1"]
OFF_DEG = 1.0  # as `uncertainty.mount_deg` has it by default
TWO = ("{instruction: as it is}", "{instruction: a quarter about z, mount: {x: +y, y: -x, z: +z}}")
BY_ONE_JOINT = (
    "{instruction: as it is, sweeps: [wrist_3]}",
    "{instruction: x along wrist 3, sweeps: [wrist_3], mount: {x: +z, y: +x, z: +y}}",
    "{instruction: y along wrist 3, sweeps: [wrist_3], mount: {x: +y, y: +z, z: +x}}",
)


def solved(setup: Setup, seed: int, off_deg: Array) -> tuple[Array, Budget, tuple[EstimatedMount, ...]]:
    """(3,) errors of the scale, the budget, and the mounts that were found."""
    runs, scale = drawn_stages(seed, KIND, setup, off_deg)
    recordings, mounts = observe_as_mounted(runs, runs[0].settings)
    result = solve_observed(runs[0].sensors, recordings, environment=find_environment(recordings, runs[0].settings))[
        "gyro"
    ]
    assert result.uncertainty is not None
    return result.scale - scale, result.uncertainty, mounts


@pytest.mark.thorough
@pytest.mark.proof
def test_three_mountings_determine_the_scale_as_well_as_their_budget_states(thorough: bool) -> None:
    ratios = []
    for seed in SEEDS if thorough else FEW:
        error, budget, _ = solved(stage_setup(Setup()), seed, np.random.default_rng(seed).uniform(-1, 1, (3, 3)))
        ratios.append(error / budget.std[:3])
    rms = float(np.sqrt(np.mean(np.square(ratios))))
    assert (0.8 if thorough else 0.3) < rms < (1.2 if thorough else 2.0), rms


def test_how_the_item_was_mounted_off_is_found() -> None:
    off_deg = np.array([[0.0, 0.0, 0.0], [1.0, -0.5, 0.8]])
    _, budget, (mount,) = solved(stage_setup(Setup(), TWO), 3, off_deg)
    assert mount.stage == 1
    assert mount.rotation_rad == pytest.approx(-np.radians(off_deg[1]), abs=4 * float(mount.std_rad.max()))
    assert mount.std_rad.max() < np.radians(OFF_DEG) / 10
    line = next(contributor for contributor in budget.contributors if contributor.name == "remounting")
    assert line.half_width == OFF_DEG


def test_what_one_axis_a_stage_does_not_tell_of_the_mounts_is_in_the_budget() -> None:
    setup = stage_setup(replace(Setup(), repeats=2), BY_ONE_JOINT)
    off_deg = np.random.default_rng(5).uniform(-OFF_DEG, OFF_DEG, (3, 3))
    error, budget, mounts = solved(setup, 5, off_deg)
    assert min(mount.std_rad.max() for mount in mounts) > np.radians(OFF_DEG) / 3
    assert budget.std_of("remounting")[:3].max() > 1e-5
    assert np.abs(error / budget.std[:3]).max() < 4


def test_an_item_that_is_not_mounted_anew_is_recorded_as_before() -> None:
    run = synthetic_run(Setup())
    assert run.settings.mounts == ()
    assert settings_from_json(run.settings.to_json()) == run.settings
    assert observe_as_mounted([run], run.settings)[1] == ()


def test_the_mounts_are_recorded() -> None:
    runs, _ = drawn_stages(1, KIND, stage_setup(Setup(), TWO), np.zeros((2, 3)))
    assert [run.settings.stage for run in runs] == [0, 1]
    again = settings_from_json(runs[1].settings.to_json())
    assert again == runs[1].settings
    assert np.array(again.mount) == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    with pytest.raises(ValueError, match="not a rotation"):
        settings_from_json(replace(runs[1].settings, mounts=(((2.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)),) * 2).to_json())
    with pytest.raises(ValueError, match="of stage 2"):
        settings_from_json(replace(runs[1].settings, stage=2).to_json())
