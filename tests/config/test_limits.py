"""A limit is one row: a key of the configuration, of what is recorded, and of what may be changed afterwards."""

import json

import pytest

from rig.config.judging.verdict_limits import LIMITS, Limits, Need
from rig.config.load import ConfigurationRefused, load, parse
from rig.data.recording.settings import setting_path, settings_from_json, settings_of
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures
from support.paths import CONFIGS

PAIR = CONFIGS / "lsm9ds1_adis16465.yaml"


def test_every_limit_is_configured_recorded_and_changed_under_one_key() -> None:
    limits = {key: 0.5 + i for i, key in enumerate(LIMITS)}
    config = load(PAIR, [f"limits.{key}={limit}" for key, limit in limits.items()]).config
    made = settings_of(config, first_phase(load_procedures()[config.procedure.name], config, load_procedures()).plan())
    recorded = json.loads(made.to_json())["limits"]
    assert recorded == limits
    assert settings_from_json(made.to_json()).limits == Limits(**limits)
    changed = made.apply_overrides([f"{setting_path(key)}={2 * limit}" for key, limit in limits.items()])
    assert changed.limits == Limits(**{key: 2 * limit for key, limit in limits.items()})


def test_a_recording_may_lack_a_limit_of_today_and_have_one_of_tomorrow() -> None:
    config = load(PAIR).config
    made = settings_of(config, first_phase(load_procedures()[config.procedure.name], config, load_procedures()).plan())
    document = json.loads(made.to_json())
    del document["limits"]["bias_drift_rad_s"]
    document["limits"]["field_bias_t"] = 1e-6
    assert settings_from_json(json.dumps(document)) == made
    del document["limits"]["bias_rad_s"]
    with pytest.raises(ValueError, match=r"settings\.limits\.bias_rad_s"):
        settings_from_json(json.dumps(document))


def test_no_two_limits_hold_the_same() -> None:
    held = [(row.quantity, row.what) for row in LIMITS.values()]
    assert len(set(held)) == len(held) == len(Limits.model_fields)


@pytest.mark.parametrize(
    ("need", "overrides"),
    [
        ("verification", ["procedure.name=verify"]),
        ("accelerometer", ["procedure={name: static_attitudes}", "sensors.gyro.acceleration={}"]),
        ("repeated attitudes", ["procedure={name: static_attitudes, repeats: 2}", "sensors.gyro.acceleration={}"]),
        ("bias drift", ["procedure={name: bias_drift}", "sensors.gyro.acceleration={}"]),
    ],
)
def test_a_limit_that_is_needed_and_not_set_is_named(need: Need, overrides: list[str]) -> None:
    whole = [*overrides, *(f"limits.{key}=1" for key, row in LIMITS.items() if row.needed_by is not None)]
    text = load(PAIR, whole).text
    for key in (key for key, row in LIMITS.items() if row.needed_by == need):
        with pytest.raises(ConfigurationRefused) as refused:
            parse(text, overrides=[f"limits.{key}=null"])
        (problem,) = refused.value.problems
        assert f"limits.{key}" in problem and problem.count("limits.") == 1
