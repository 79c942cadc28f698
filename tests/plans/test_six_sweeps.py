"""The plan of the six observations: whole revolutions at constant speed, merged transfers, honest durations."""

import math

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.errors import Refused
from rig.motion.carried import FlangeLoad
from rig.motion.geometry import flange_axes, flange_pose, flange_rate
from rig.motion.model import find_home
from rig.motion.steps import Plan, Rest, Sweep, Transfer, trapezoid_duration, travel
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.steady_drift import drift_effect
from support.wires.ur10e import plan_problems

ARM = ArmSection(host="127.0.0.2", payload_kg=0.35)
HOME = find_home(ARM)


def plan(**settings: object) -> Plan:
    return plan_six_observation(ARM, SixObservationSection.model_validate(settings))


def test_the_order_is_the_paper_s() -> None:
    assert [(sweep.joint_name, sweep.direction) for sweep in plan().sweeps] == [
        ("wrist_3", "cw"),
        ("wrist_3", "ccw"),
        ("wrist_1", "cw"),
        ("wrist_1", "ccw"),
        ("wrist_2", "cw"),
        ("wrist_2", "ccw"),
    ]


def test_six_axes_are_the_three_and_three_between_them() -> None:
    made = plan(axes=6)
    axes = {tuple(np.round(np.abs(sweep.axis_flange) * np.sqrt(2), 3) ** 2 / 2) for sweep in made.sweeps}
    assert len(made.sweeps) == 12
    assert len(axes) == 6
    assert plan_problems(made, FlangeLoad(0.35)) == []


@pytest.mark.slow
@pytest.mark.parametrize("wrist_2_deg", [-90.0, 90.0])
def test_the_flange_never_turns_towards_the_forearm(wrist_2_deg: float) -> None:
    """Wrist 1 turns in the forearm's plane: along its axis the flange keeps its distance, 0.174 m, or has more."""
    arm = ArmSection(host="127.0.0.2", payload_kg=0.35, home_deg=(0, -90, 90, -90, wrist_2_deg, 0))
    made = plan_six_observation(arm, SixObservationSection(axes=6))
    assert plan_problems(made, FlangeLoad(0.35)) == []
    for sweep in made.sweeps:
        if sweep.joint_name == "wrist_1":
            pose = flange_pose(sweep.start_q_rad)
            axis = pose[:3, :3] @ flange_axes(sweep.start_q_rad)[:, 3]
            assert abs(axis @ (pose[:3, 3] - (0.0, 0.0, 0.1807))) > 0.174


def test_every_sweep_is_made_at_every_speed() -> None:
    made = plan(speeds_deg_s=[30, 60, 120], speed_deg_s=10)
    seen = [(sweep.joint_name, sweep.direction, round(math.degrees(sweep.speed_rad_s))) for sweep in made.sweeps]
    assert len(set(seen)) == len(seen) == 18
    assert {speed for *_, speed in seen} == {30, 60, 120}


@pytest.mark.parametrize(
    ("changes", "less"),
    [({"repeats": 2}, 0.2), ({"axes": 6}, 0.35), ({"axes": 6, "order": ["wrist_1", "wrist_2", "wrist_3"]}, 0.5)],
)
def test_the_order_makes_little_of_a_steady_drift(changes: dict[str, object], less: float) -> None:
    named = plan(**{**changes, "order": ["wrist_3", "wrist_1", "wrist_2"], "directions": ["cw", "ccw"]})
    assert drift_effect(plan(**changes).steps) < less * drift_effect(named.steps)


def test_an_order_the_file_names_is_kept() -> None:
    made = plan(axes=6, order=["wrist_2", "wrist_3", "wrist_1"], directions=["ccw", "cw"])
    assert [sweep.name for sweep in made.sweeps[:5]] == [
        "sweep wrist_2 ccw",
        "sweep wrist_2 cw",
        "sweep wrist_3 ccw",
        "sweep wrist_3 cw",
        "sweep wrist_1 ccw",
    ]
    assert [sweep.joint_name for sweep in plan(order=["wrist_2", "wrist_3", "wrist_1"]).sweeps[::2]] == [
        "wrist_2",
        "wrist_3",
        "wrist_1",
    ]


@pytest.mark.slow
def test_steps_join_without_a_gap_and_end_at_home() -> None:
    made = plan(axes=6, speeds_deg_s=[60, 90])
    here = made.start_q_rad
    for motion in made.motions:
        np.testing.assert_allclose(motion.start_q_rad, here, atol=1e-12)
        here = motion.target_q_rad
    np.testing.assert_allclose(here, HOME)


def test_transfers_are_merged_into_one_motion_between_wrists() -> None:
    kinds = [type(step) for step in plan().steps]
    wrist = [Transfer, Sweep, Rest, Sweep, Rest]
    assert kinds == [*wrist, *wrist, *wrist, Transfer]


@pytest.mark.parametrize("speed_deg_s", [5.0, 60.0, 100.0])
def test_every_revolution_runs_at_constant_speed_with_the_margin_on_each_side(speed_deg_s: float) -> None:
    for sweep in plan(speed_deg_s=speed_deg_s, margin_deg=3.0).sweeps:
        low, high = sweep.revolution_rad
        assert high - low == pytest.approx(2 * math.pi, abs=1e-12)
        assert (low + high) / 2 == pytest.approx(HOME[sweep.joint])
        ramp_rad = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2)
        ends = sorted((sweep.start_q_rad[sweep.joint], sweep.end_q_rad[sweep.joint]))
        assert low - ends[0] - ramp_rad == pytest.approx(math.radians(3))
        assert ends[1] - high - ramp_rad == pytest.approx(math.radians(3))


def test_only_the_swept_wrist_moves_and_the_axis_is_the_flange_s_turn() -> None:
    for sweep in plan(axes=6).sweeps:
        moved = np.array(travel(sweep.start_q_rad, sweep.end_q_rad))
        assert np.flatnonzero(moved).tolist() == [sweep.joint]
        assert (moved[sweep.joint] > 0) == (sweep.direction == "ccw")
        rate = flange_rate(sweep.start_q_rad, np.sign(moved))
        np.testing.assert_allclose(sweep.axis_flange, rate, atol=1e-12)


def test_duration_is_the_sum_of_motions_and_rests() -> None:
    # 60°/s and 80°/s²: 22.5° of ramp and 2° of margin on each side of 360° take 409°/60 + 60/80 s.
    sweep_s = 409 / 60 + 0.75
    transfer_s = 204.5 / 90 + 90 / 80
    slow = ArmSection(host="127.0.0.2", payload_kg=0.35, transfer_speed_deg_s=90)
    procedure = SixObservationSection(speed_deg_s=60, acceleration_deg_s2=80, rest_s=3, margin_deg=2)
    made = plan_six_observation(slow, procedure)
    assert made.duration_s == pytest.approx(6 * (sweep_s + 3) + 4 * transfer_s)


def test_a_short_move_never_reaches_its_speed() -> None:
    assert trapezoid_duration(0.01, 1.0, 1.0) == pytest.approx(0.2)
    assert trapezoid_duration(1.0, 1.0, 1.0) == pytest.approx(2.0)


def test_from_elsewhere_the_first_motion_goes_home_at_leisure() -> None:
    start = (0.1, *HOME[1:])
    first = plan_six_observation(ARM, SixObservationSection(), start).steps[0]
    assert isinstance(first, Transfer)
    assert (first.start_q_rad, first.target_q_rad) == (start, HOME)
    assert math.degrees(first.speed_rad_s) <= 30


def test_a_run_that_goes_on_leaves_out_what_is_done() -> None:
    rest_of_it = plan_six_observation(ARM, SixObservationSection(), done={0, 1, 2})
    assert [sweep.index for sweep in rest_of_it.sweeps] == [3, 4, 5]
    assert plan_six_observation(ARM, SixObservationSection(), done=range(6)).steps == ()


def test_a_home_pose_with_parallel_wrists_is_refused() -> None:
    parallel = ArmSection(host="127.0.0.2", payload_kg=0.35, home_deg=(0, -90, 90, -90, 0, 0))
    with pytest.raises(Refused, match="axes_do_not_span"):
        plan_six_observation(parallel, SixObservationSection())


def test_configuration_sets_order_directions_repeats_and_rests() -> None:
    made = plan(order=["wrist_2", "wrist_3", "wrist_1"], directions=["ccw", "cw"], repeats=2, rest_s=0)
    assert [sweep.index for sweep in made.sweeps] == list(range(12))
    assert [sweep.name for sweep in made.sweeps[:3]] == ["sweep wrist_2 ccw", "sweep wrist_2 cw", "sweep wrist_3 ccw"]
    assert [sweep.name for sweep in made.sweeps[6:]] == [sweep.name for sweep in made.sweeps[:6]]
    assert not any(isinstance(step, Rest) for step in made.steps)
