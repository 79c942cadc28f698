"""The recorded settings: written and read alike, and changed by name or refused by name."""

import json
from dataclasses import replace

import pytest

from rig.config.judged_by import OF_SENSORS
from rig.config.load import load, parse
from rig.config.procedure_sections import SixSweepsSection
from rig.config.sensor_catalogue import PARTS
from rig.data.settings import RunSettings, settings_from_json, settings_of
from rig.data.settings_of_run_1 import settings_of_configuration
from rig.errors import Refused
from rig.motion.steps import Plan
from rig.plans.six_sweeps import plan_six_observation
from support.paths import CONFIGS, FIXTURES

VERIFIED = load(CONFIGS / "lsm9ds1_adis16465.yaml").text


def settings(text: str = VERIFIED) -> RunSettings:
    config = parse(text).config
    assert isinstance(config.procedure, SixSweepsSection)
    plan: Plan = plan_six_observation(config.arm, config.procedure)
    return settings_of(config, plan)


def test_what_is_recorded_comes_back() -> None:
    made = settings()
    assert made.then_verify
    assert made.reference is not None
    assert settings_from_json(made.to_json()) == made


def test_what_is_known_of_a_sensor_is_recorded_its_part_s_where_nothing_is_said() -> None:
    """So that a catalogue of tomorrow changes no recording."""
    said = settings("uncertainty: {acceleration_bias_mg_k: 0.7}\n" + VERIFIED).uncertainty
    assert said is not None
    for what in OF_SENSORS:
        part = getattr(PARTS["adis16465"], what)
        assert getattr(said, what)["reference"] == (0.7 if what == "acceleration_bias_mg_k" else part)
    assert said.of("acceleration_bias_instability_ug", "another", "adis16465") == 3.6


@pytest.mark.parametrize(("section", "key"), [("uncertainty", "axis_deg"), ("observation", "max_lost_fraction")])
def test_what_every_recording_says_is_refused_where_it_is_lost(section: str, key: str) -> None:
    document = json.loads(settings().to_json())
    del document[section][key]
    with pytest.raises(ValueError, match=rf"settings\.{section}.*lacks {key}"):
        settings_from_json(json.dumps(document))


def test_a_key_that_a_recording_is_too_old_for_is_what_it_was_then_not_what_is_usual_today() -> None:
    document = json.loads(settings().to_json())
    del document["uncertainty"]["mount_deg"], document["uncertainty"]["bias_deg_s_k"]
    read = settings_from_json(json.dumps(document)).uncertainty
    assert read is not None and read.mount_deg == 0.0 and read.bias_deg_s_k == {}
    assert parse(VERIFIED).config.uncertainty.mount_deg == 1.0
    assert read.of("bias_deg_s_k", "gyro", "lsm9ds1") == PARTS["lsm9ds1"].bias_deg_s_k


@pytest.mark.parametrize("name", ["calibration", "verified"])
def test_a_configuration_of_commit_af3b9f0_reads_as_it_did_then(name: str) -> None:
    text = (FIXTURES / name / "config.yaml").read_text(encoding="utf-8")
    # Nothing has changed its meaning so far; that there is a site, and what follows from it, is new.
    assert settings_of_configuration(text) == replace(settings(text), site=None, uncertainty=None, reckoning=1)


@pytest.mark.parametrize(
    "change",
    [
        {"schema": "rig.settings/9"},
        {"limits": None},
        {"home_q_rad": [0.0] * 9},
        {"planned_sweeps": [{"index": 0}]},
        {"to_calibrate": []},
        {"observation": {"max_lost_fraction": 1.5, "max_speed_deviation": 0.1, "max_axis_deviation_deg": 5}},
    ],
    ids=str,
)
def test_other_settings_are_not_taken_for_these(change: dict[str, object]) -> None:
    text = json.dumps({**json.loads(settings().to_json()), **change})
    with pytest.raises(ValueError, match=next(iter(change))):
        settings_from_json(text)


@pytest.mark.parametrize(
    "text",
    ["", "a: [", "[]", "sensors: {gyro: 3}", "sensors: {}\nlimits: 3", "sensors: {}\nprocedure: {repeats: 1000000000}"],
)
def test_a_text_that_never_was_a_configuration_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"configuration|settings"):
        settings_of_configuration(text)


def test_thresholds_and_limits_can_be_changed_for_another_judgement() -> None:
    changed = settings().with_overrides(["observation.max_lost_fraction=0.01", "limits.scale_std = 1e-3"])
    assert changed.observation.max_lost_fraction == 0.01
    limits, before = changed.limits, settings().limits
    assert limits is not None and before is not None
    assert limits.scale_std == 0.001
    assert limits.bias_rad_s == before.bias_rad_s


def test_how_well_the_encoders_tell_arcs_can_be_stated_anew() -> None:
    changed = settings().with_overrides(["uncertainty.angle_std_deg=0.02"]).uncertainty
    assert changed is not None and changed.angle_std_deg == 0.02
    with pytest.raises(Refused, match=r"unknown_setting.*states no uncertainty"):
        replace(settings(), uncertainty=None).with_overrides(["uncertainty.angle_std_deg=0.02"])


def test_a_recording_of_before_can_be_reckoned_as_of_today() -> None:
    text = json.dumps({**json.loads(settings().to_json()), "schema": "rig.settings/6"})
    before = settings_from_json(text.replace('"reckoning": 3', '"reckoning": 1'))
    assert before.reckoning == 1 and before.with_overrides(["reckoning=3"]).reckoning == settings().reckoning == 3


@pytest.mark.parametrize(
    ("override", "refusal"),
    [
        (
            "observation.max_lost=0.01",
            r"unknown_setting.*'observation\.max_lost'.*max_lost_fraction, .*limits",
        ),
        ("procedure.speed_deg_s=10", "unknown_setting"),
        ("limits", "unknown_setting"),
        ("uncertainty.axis_deg=1", "unknown_setting"),
        ("uncertainty.angle_std_deg=-0.1", r"wrong_setting.*greater than or equal to 0"),
        ("limits.scale_std=small", r"wrong_setting.*limits\.scale_std is 'small'"),
        ("limits.scale_std=-1", "wrong_setting.*greater than 0"),
        ("limits.scale_std=nan", "wrong_setting"),
        ("limits.scale_std", "wrong_setting"),
        ("observation.max_lost_fraction=1", "wrong_setting.*less than 1"),
        ("limits.scale_std=" + 5000 * "9", "wrong_setting"),
        ("limits.\x1b[31m=1", r"unknown_setting.*x1b"),
    ],
)
def test_what_cannot_be_changed_is_refused_with_what_can(override: str, refusal: str) -> None:
    with pytest.raises(Refused, match=refusal) as refused:
        settings().with_overrides([override])
    assert len(str(refused.value)) < 800
    assert "\x1b" not in str(refused.value)
