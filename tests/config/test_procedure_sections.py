"""The `procedure:` section is the one its name chooses, and judges the rest of the file itself."""

from collections.abc import Iterator
from typing import Annotated, Literal

import pytest
from pydantic import Field

from rig.config.load import ConfigurationRefused, load, parse
from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedures.procedure_sections import STOCK_SECTIONS, SixObservationSection, VerifySection
from support.paths import CONFIGS

DEMO = CONFIGS / "demo.yaml"
EXPERIMENT = CONFIGS / "lsm9ds1_adis16465.yaml"


class NodSection(ProcedureSection):
    """A procedure of one's own: nods that need an LSM9DS1."""

    name: Literal["nod"] = "nod"
    nods: Annotated[int, Field(ge=1)]

    def problems(self, config: RigConfig) -> Iterator[str]:
        """What it needs of the sensors."""
        if all(sensor.part != "lsm9ds1" for sensor in config.sensors.values()):
            yield "a nod needs an lsm9ds1"


WITH_NODS: dict[str, type[ProcedureSection]] = {**STOCK_SECTIONS, "nod": NodSection}


def problems_of(*overrides: str, text: str = DEMO.read_text(encoding="utf-8")) -> tuple[str, ...]:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(text, overrides=overrides, sections=WITH_NODS)
    return caught.value.problems


def test_the_name_chooses_the_section() -> None:
    assert isinstance(load(DEMO).config.procedure, SixObservationSection)
    assert isinstance(load(EXPERIMENT, ["procedure.name=verify"]).config.procedure, VerifySection)
    custom = load(DEMO, ["procedure={name: nod, nods: 3}"], WITH_NODS).config.procedure
    assert custom == NodSection(nods=3)


@pytest.mark.parametrize("procedure", ["", "procedure: {}\n", "procedure: {rest_s: 1}\n"])
def test_without_a_name_it_is_the_six_sweeps(procedure: str) -> None:
    before, after = DEMO.read_text(encoding="utf-8").split("procedure:\n")
    loaded = parse(before + procedure + "limits:" + after.split("limits:")[1])
    assert loaded.config.procedure.name == "six_observation"


def test_a_name_not_known_is_one_error_beside_those_of_the_nearest_procedure() -> None:
    found = problems_of("procedure={name: six_obsrvation, speed_deg: 60}", "limits.condition=-1")
    assert len(found) == 3
    assert found[0].startswith("limits.condition (--set): -1: ")
    assert found[1] == (
        "procedure.name (--set): 'six_obsrvation' is not allowed, did you mean six_observation?; "
        "allowed: six_observation, verify, static_attitudes, imu, bias_drift, by_hand, servo_six_observation, "
        "thermal, nod, shortest"
    )
    assert found[2].startswith("procedure.speed_deg (--set): unknown key, did you mean speed_deg_s?")


@pytest.mark.parametrize("name", ["[1]", "3", "{}", "zzz"])
def test_a_name_that_is_none_is_refused(name: str) -> None:
    (found,) = problems_of(f"procedure.name={name}")
    assert (
        found.startswith("procedure.name (--set): ")
        and "allowed: six_observation, verify, static_attitudes, imu, bias_drift, by_hand, servo_six_observation, "
        "thermal, nod"
        in found
    )


@pytest.mark.parametrize("section", ["3", "[]", "fast"])
def test_a_section_that_is_no_section_is_refused(section: str) -> None:
    (found,) = problems_of(f"procedure={section}")
    assert found.startswith("procedure (--set): ")


def test_keys_of_another_procedure_are_unknown() -> None:
    missing, unknown = problems_of("procedure={name: nod, speed_deg_s: 60}")
    assert missing == "procedure.nods: missing"
    assert unknown == "procedure.speed_deg_s (--set): unknown key; allowed: name, nods"


def test_a_section_judges_the_rest_of_the_file() -> None:
    found = problems_of(
        "procedure={name: nod, nods: 1}", "sensors={gyro: {part: mpu9250, serial_number: a}}", "world.seed=2"
    )
    assert found == ("a nod needs an lsm9ds1",)


def test_a_verification_says_everything_it_lacks() -> None:
    (found,) = problems_of("procedure.name=verify")
    assert "role: reference" in found and "limits.verification_rms_rad_s" in found


def test_what_follows_and_what_is_needed() -> None:
    plain, verified = load(DEMO).config.procedure, load(EXPERIMENT).config.procedure
    assert (plain.then_verify, plain.needs_reference) == (False, False)
    assert (verified.then_verify, verified.needs_reference) == (True, True)
    # The file of a calibration serves its verification: `verify: true` stands in it, and means nothing then.
    alone = load(EXPERIMENT, ["procedure.name=verify"]).config.procedure
    assert (alone.then_verify, alone.needs_reference) == (False, True)
