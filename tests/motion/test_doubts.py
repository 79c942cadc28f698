"""A speed that was written in rad/s is asked about before the arm moves; it is not refused."""

from rig.config.load import load
from rig.motion.plan_warnings import doubts
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures
from support.paths import DEMO


def doubts_of(*overrides: str) -> list[str]:
    config = load(DEMO, overrides).config
    procedures = load_procedures()
    return doubts(first_phase(procedures[config.procedure.name], config, procedures).plan())


def test_the_demonstration_leaves_no_doubt() -> None:
    assert doubts_of() == []


def test_a_sweep_in_radians_a_second_is_asked_about_with_what_it_would_be_in_degrees() -> None:
    (doubt,) = doubts_of("procedure.speed_deg_s=1.047")
    assert doubt == "procedure.speed_deg_s is 1.047, which is slow: is 1.047 rad/s meant? That is 60 °/s."


def test_so_is_a_transfer_though_the_first_way_home_is_always_slower_than_the_others() -> None:
    (doubt,) = doubts_of("arm.transfer_speed_deg_s=2.09")
    assert doubt.startswith("arm.transfer_speed_deg_s is 2.09, which is slow: is 2.09 rad/s meant? That is 120 °/s.")
