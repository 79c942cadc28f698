"""The recorded settings: written and read alike, and changed by name or refused by name."""

import json

import pytest

from rig.config.judging.judging_keys import SENSOR_KEYS
from rig.config.load import load, parse
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.recording.settings import RunSettings, settings_from_json, settings_of
from rig.errors import Refused
from rig.motion.steps import Plan
from rig.plans.motions.six_sweeps import plan_six_observation
from support.paths import CONFIGS

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


def test_a_sensor_s_stated_properties_are_recorded_and_its_part_s_by_default() -> None:
    """So that a catalogue of tomorrow changes no recording."""
    said = settings("uncertainty: {acceleration_bias_mg_k: 0.7}\n" + VERIFIED).uncertainty
    assert said is not None
    for what in SENSOR_KEYS:
        part = getattr(PARTS["adis16465"], what)
        assert getattr(said, what)["reference"] == (0.7 if what == "acceleration_bias_mg_k" else part)
    assert said.find_stated_size("acceleration_bias_instability_ug", "reference") == 3.6


@pytest.mark.parametrize(("section", "key"), [("uncertainty", "axis_deg"), ("observation", "max_lost_fraction")])
def test_what_every_recording_says_is_refused_where_it_is_lost(section: str, key: str) -> None:
    document = json.loads(settings().to_json())
    del document[section][key]
    with pytest.raises(ValueError, match=rf"settings\.{section}.*lacks {key}"):
        settings_from_json(json.dumps(document))


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


def test_thresholds_and_limits_can_be_changed_for_another_judgement() -> None:
    changed = settings().apply_overrides(["observation.max_lost_fraction=0.01", "limits.scale_std = 1e-3"])
    assert changed.observation.max_lost_fraction == 0.01
    limits, before = changed.limits, settings().limits
    assert limits is not None and before is not None
    assert limits.scale_std == 0.001
    assert limits.bias_rad_s == before.bias_rad_s


def test_how_well_the_encoders_tell_arcs_can_be_stated_anew() -> None:
    changed = settings().apply_overrides(["uncertainty.angle_std_deg=0.02"]).uncertainty
    assert changed is not None and changed.angle_std_deg == 0.02


@pytest.mark.parametrize(
    ("override", "refusal"),
    [
        (
            "observation.max_lost=0.01",
            r"unknown_setting.*'observation\.max_lost'.*Did you mean observation\.max_lost_fraction.*limits",
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
        settings().apply_overrides([override])
    assert len(str(refused.value)) < 800
    assert "\x1b" not in str(refused.value)
