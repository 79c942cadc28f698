"""What judges a recording is one row: a key of the configuration, and of what is recorded."""

import json

from rig.config.judging.judging_keys import SENSOR_KEYS, ObservationKeys, UncertaintyKeys
from rig.config.load import load
from rig.data.recording.settings import settings_from_json, settings_of
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures
from support.paths import CONFIGS

PAIR = CONFIGS / "lsm9ds1_adis16465.yaml"


def test_every_threshold_and_every_uncertainty_is_configured_and_recorded_under_one_key() -> None:
    sizes = [key for key in UncertaintyKeys.model_fields if key != "decision_rule"]
    stated = [f"observation.{key}=0.5" for key in ObservationKeys.model_fields]
    stated += [f"uncertainty.{key}=0.5" for key in sizes]
    config = load(PAIR, [*stated, "uncertainty.decision_rule=guard_band"]).config
    made = settings_of(config, first_phase(load_procedures()[config.procedure.name], config, load_procedures()).plan())
    recorded, of_each = json.loads(made.to_json()), dict.fromkeys(config.sensors, 0.5)
    assert recorded["observation"] == dict.fromkeys(ObservationKeys.model_fields, 0.5)
    sizes_recorded = {key: of_each if key in SENSOR_KEYS else 0.5 for key in sizes}
    assert recorded["uncertainty"] == {**sizes_recorded, "decision_rule": "guard_band"}
    assert settings_from_json(made.to_json()) == made
