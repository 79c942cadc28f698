"""`procedure: {name: shortest}`: a procedure that ends when the uncertainty is what is wanted."""

import pytest

from rig.config.load import ConfigurationRefused, parse
from rig.config.models import ProcedureSection
from rig.config.procedure_sections import SixObservationSection
from support.synthetic_run import CONFIG

TEXT = CONFIG.format(speed_deg_s=60, rest_s=3, repeats=8, part="lsm9ds1", procedure="", uncertainty="")


def section(*overrides: str) -> ProcedureSection:
    return parse(TEXT, overrides=["procedure.name=shortest", *overrides]).config.procedure


def test_it_is_carried_out_as_six_observations_that_end_early() -> None:
    found = section("procedure.wanted={scale: 5e-4, bias: 1e-4}")
    assert isinstance(found, SixObservationSection)
    assert (found.name, found.repeats, found.speed_deg_s) == ("six_observation", 8, 60.0)
    assert (found.wanted_scale_u, found.wanted_bias_u_rad_s) == (5e-4, 1e-4)


def test_without_a_number_of_repeats_there_are_enough() -> None:
    text = TEXT.replace("repeats: 8", "margin_deg: 2")
    found = parse(text, overrides=["procedure.name=shortest", "procedure.wanted={bias: 1e-4}"]).config.procedure
    assert isinstance(found, SixObservationSection)
    assert (found.repeats, found.wanted_scale_u, found.wanted_bias_u_rad_s) == (16, None, 1e-4)


@pytest.mark.parametrize("wish", [(), ("procedure.wanted=5e-4",), ("procedure.wanted={field: 1}",)])
def test_a_wish_that_is_none_is_refused_by_its_place(wish: tuple[str, ...]) -> None:
    with pytest.raises(ConfigurationRefused, match=r"procedure\.wanted"):
        section(*wish)
