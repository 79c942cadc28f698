"""What the sensors say of how the item is mounted: refused before a sweep turns it, with the axis it looks like."""

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.config.procedures.stage_section import StageMountSection, mount_matrix
from rig.data.quantity import ACCELERATION
from rig.data.recording.channel import triad_channel
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.motion.steps import Stage
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.runner.announcement import mounting
from rig.runner.mounting import GyroscopeReadings, refuse_hanging_otherwise, refuse_turning_otherwise, refuse_unsteady
from rig.turners.turner_registry import words_of
from support.recordings.synthetic_run import SENSITIVITY, SENSOR

COUNT = 476  # two seconds
UNIT_M_S2 = 0.001


def stage(mount: Array) -> Stage:
    first, second, third = ((x, y, z) for x, y, z in mount.tolist())
    return Stage((first, second, third), "turn the board by 90° about wrist 3", frozenset(), 0)


NOMINAL = stage(np.eye(3))
QUARTER = stage(mount_matrix(StageMountSection(x="+y", y="-x", z="+z")))


def reading(rates_rad_s: Array, seed: int = 1) -> GyroscopeReadings:
    samples = np.zeros(COUNT, SENSOR.sample_dtype)
    noise = 0.035 * np.random.default_rng(seed).standard_normal((COUNT, 3))
    samples["counts"] = np.round((rates_rad_s + noise) / SENSITIVITY)
    return GyroscopeReadings("gyro", SENSOR, samples)


def test_noise_and_bias_are_rest() -> None:
    for seed in range(20):
        refuse_unsteady(reading(np.array([0.1, -0.05, 0.02]), seed), "arm")


def test_a_hand_at_the_board_is_none() -> None:
    swinging = 0.15 * np.sin(np.linspace(0, 6, COUNT))[:, None] * [1.0, 0.3, 0.0]
    with pytest.raises(Refused, match="while the servomotor stands still") as refused:
        refuse_unsteady(reading(swinging), "servomotor")
    assert refused.value.name == "item_not_at_rest"


def turning(about: int, angle_deg: float) -> Array:
    rates = np.zeros((COUNT, 3))
    inside = slice(100, 300)
    rates[inside, about] = np.radians(angle_deg) * SENSOR.rate_hz / 200
    return rates + 0.1


def test_a_turn_that_is_felt_as_the_stage_says_is_none_to_refuse() -> None:
    refuse_turning_otherwise(reading(turning(0, 10)), np.full(3, 0.1), NOMINAL, np.radians([10.0, 0, 0]), "trial")
    refuse_turning_otherwise(reading(turning(1, -10)), np.full(3, 0.1), QUARTER, np.radians([10.0, 0, 0]), "trial")


@pytest.mark.parametrize(
    ("about", "angle_deg", "words"),
    [
        (0, -10.0, r"item's \+x axis .* about its -x axis"),
        (1, 10.0, r"\+x axis .* \+y axis"),
        (2, 1.0, "reads .* of 10.0°"),
    ],
)
def test_another_axis_another_sign_and_hardly_a_turn_are_detected(about: int, angle_deg: float, words: str) -> None:
    with pytest.raises(Fault, match=words) as refused:
        refuse_turning_otherwise(
            reading(turning(about, angle_deg)), np.full(3, 0.1), NOMINAL, np.radians([10.0, 0, 0]), "trial of wrist_1"
        )
    assert refused.value.name == "mounted_otherwise"
    assert "turn the board by 90° about wrist 3" in refused.value.remedy


def hanging(force_m_s2: list[float]) -> GyroscopeReadings:
    channels = (*SENSOR.channels, triad_channel(ACCELERATION, UNIT_M_S2, 32767, 2 * 9.80665))
    sensor = RecordedSensor(SENSOR.part, SENSOR.serial_number, SENSOR.rate_hz, channels)
    samples = np.zeros(COUNT, sensor.sample_dtype)
    samples[sensor.channel(ACCELERATION).column] = np.round(np.array(force_m_s2) / UNIT_M_S2)
    return GyroscopeReadings("gyro", sensor, samples)


def test_gravity_is_where_the_mounting_says_or_the_axis_is_named() -> None:
    refuse_hanging_otherwise(hanging([0.2, -0.3, 9.8]), NOMINAL, np.array([0.0, 0.0, 1.0]))
    refuse_hanging_otherwise(hanging([0.0, -9.8, 0.0]), QUARTER, np.array([1.0, 0.0, 0.0]))
    with pytest.raises(Refused, match=r"item's -y axis points up, by the stage's mounting its \+x axis"):
        refuse_hanging_otherwise(hanging([0.0, -9.8, 0.0]), NOMINAL, np.array([1.0, 0.0, 0.0]))


def test_what_feels_no_gravity_says_nothing_of_it() -> None:
    refuse_hanging_otherwise(reading(np.zeros(3)), NOMINAL, np.array([0.0, 0.0, 1.0]))


def test_the_question_before_a_stage_speaks_of_what_turns_the_item() -> None:
    stages = SixObservationSection.model_validate({"stages": [{"instruction": "as it is"}]})
    plan = plan_six_observation(ArmSection(host="127.0.0.2", payload_kg=0.35), stages)
    of_an_arm, of_another = (mounting(plan, 0, words_of(kind)) for kind in ("ur", "one nobody knows"))
    assert "sweeps turn the wrists by" in " ".join(of_an_arm.announcement)
    assert "within the arm's reach" in of_an_arm.to_tick
    said = " ".join([*of_another.announcement, of_another.to_tick]).replace("wrist_", "joint ")  # is the plan's
    assert "The turner stands still" in said and "within the turner's reach" in said
    assert "arm" not in said and "wrist" not in said
