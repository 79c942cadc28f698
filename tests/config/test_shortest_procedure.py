"""`procedure: {name: shortest}`: a procedure that ends when the uncertainty is what is wanted."""

import pytest

from rig.config.load import ConfigurationRefused, load, parse
from rig.config.models import ProcedureSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.data.recording.settings import settings_of
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.procedure_registry import load_procedures, sections
from rig.turners import turner_registry as turners
from support.paths import CONFIGS
from support.recordings.synthetic_run import CONFIG

TEXT = CONFIG.format(speed_deg_s=60, rest_s=3, repeats=8, part="lsm9ds1", procedure="", uncertainty="")


def section(*overrides: str) -> ProcedureSection:
    return parse(TEXT, overrides=["procedure.name=shortest", *overrides]).config.procedure


def test_it_is_carried_out_as_six_observations_that_end_early() -> None:
    found = section("procedure.target_uncertainty={scale: 5e-4, bias: 1e-4}")
    assert isinstance(found, SixObservationSection)
    assert (found.name, found.repeats, found.speed_deg_s) == ("six_observation", 8, 60.0)
    assert (found.target_scale_u, found.target_bias_u_rad_s) == (5e-4, 1e-4)


def test_without_a_number_of_repeats_there_are_enough() -> None:
    text = TEXT.replace("repeats: 8", "margin_deg: 2")
    found = parse(
        text, overrides=["procedure.name=shortest", "procedure.target_uncertainty={bias: 1e-4}"]
    ).config.procedure
    assert isinstance(found, SixObservationSection)
    assert (found.repeats, found.target_scale_u, found.target_bias_u_rad_s) == (16, None, 1e-4)


@pytest.mark.parametrize(
    ("wish", "where"),
    [
        ((), "procedure.target_uncertainty: state the expanded uncertainty"),
        (("procedure.target_uncertainty=5e-4",), "procedure.target_uncertainty (--set): "),
        (("procedure.target_uncertainty={field: 1}",), "procedure.target_uncertainty.field"),
        (("procedure.target_uncertainty={scale: often}",), "procedure.target_uncertainty.scale"),
        (("procedure.target_uncertainty={bias: 0}",), "procedure.target_uncertainty.bias"),
    ],
)
def test_a_wish_that_is_none_is_refused_by_its_place(wish: tuple[str, ...], where: str) -> None:
    with pytest.raises(ConfigurationRefused) as refused:
        section(*wish)
    assert where in "\n".join(refused.value.problems)


@pytest.mark.parametrize(
    ("file", "instead"), [("servo.yaml", "servo_six_observation"), ("by_hand.yaml", "name: by_hand")]
)
def test_where_no_arm_turns_it_is_refused_with_what_to_do_instead(file: str, instead: str) -> None:
    changes = ["procedure={name: shortest, target_uncertainty: {scale: 1e-3}}"]
    with pytest.raises(ConfigurationRefused) as refused:
        load(CONFIGS / file, changes, sections(load_procedures()), turners.sections())
    (problem,) = refused.value.problems
    assert (
        problem.startswith("procedure.name")
        and instead in problem
        and "rig plan CONFIG --target-uncertainty" in problem
    )


def test_a_misspelt_name_is_told_of_it() -> None:
    with pytest.raises(ConfigurationRefused, match="did you mean shortest"):
        section("procedure.name=shortes", "procedure.target_uncertainty={bias: 1e-4}")


def test_what_is_wanted_is_a_limit_of_the_verdict_unless_the_file_has_its_own() -> None:
    wish = "procedure.target_uncertainty={scale: 5e-4, bias: 1e-4}"
    for said, limit in (((), 5e-4), (("limits.scale_u=2e-3",), 2e-3)):
        config = parse(TEXT, overrides=["procedure.name=shortest", wish, *said]).config
        plan = plan_six_observation(config.arm, config.procedure)  # pyrefly: ignore[bad-argument-type]  # this file has its section
        limits = settings_of(config, plan).limits
        assert limits is not None and (limits.scale_u, limits.bias_u_rad_s) == (limit, 1e-4)
