"""The plan of static attitudes, alone and after sweeps: each once, by a short way, clear of the forearm."""

import math
from itertools import pairwise, permutations, product

import numpy as np
import pytest
from pydantic import ValidationError

from rig.config.load import load
from rig.config.models import ArmSection
from rig.config.procedures.attitude_sets import FACE_ATTITUDES, OPTIMAL_ATTITUDES
from rig.config.procedures.procedure_sections import ImuSection, StaticAttitudesSection
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.motion.carried import FlangeLoad
from rig.motion.model import find_home
from rig.motion.steps import Dwell, Plan, Rest, Sweep, Transfer, trapezoid_duration
from rig.plans.motions.shortest_tour import shortest_way
from rig.plans.motions.static_attitudes import plan_static_attitudes
from rig.plans.motions.sweeps_and_attitudes import plan_imu
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures
from support.paths import CONFIGS
from support.wires.ur10e import plan_problems

ARM = ArmSection(host="127.0.0.2", payload_kg=0.35)
HOME = find_home(ARM)


def plan(**settings: object) -> Plan:
    return plan_static_attitudes(ARM, StaticAttitudesSection.model_validate(settings))


def imu(**settings: object) -> Plan:
    return plan_imu(ARM, ImuSection.model_validate(settings))


def wrists_deg(dwell: Dwell) -> tuple[float, ...]:
    return tuple(round(math.degrees(angle), 6) for angle in dwell.q_rad[3:])


def stands_where_it_came(made: Plan) -> bool:
    """Every step begins where the one before ended, the first at the start, the last at home."""
    here = made.start_q_rad
    for step in made.steps:
        match step:
            case Transfer() | Sweep():
                if step.start_q_rad != here:
                    return False
                here = step.target_q_rad
            case Dwell():
                if step.q_rad != here:
                    return False
    return here == made.home_q_rad


def test_every_attitude_is_held_once_with_base_shoulder_and_elbow_at_home() -> None:
    made = plan()
    assert sorted(map(wrists_deg, made.dwells)) == sorted(OPTIMAL_ATTITUDES)
    assert {dwell.q_rad[:3] for dwell in made.dwells} == {HOME[:3]}
    assert [dwell.index for dwell in made.dwells] == list(range(18))
    assert {(dwell.duration_s, dwell.settle_s) for dwell in made.dwells} == {(3.0, 5.0)}
    assert stands_where_it_came(made) and plan_problems(made, FlangeLoad(0.35)) == []
    assert made.dwells[0].name == "dwell at -45 -90 -45"


def test_a_field_test_is_a_rest_at_home_before_and_after() -> None:
    made = plan(attitudes="magnetic", field_test_s=5)
    first, *_, last = made.steps
    assert isinstance(first, Rest) and isinstance(last, Rest) and first.duration_s == last.duration_s == 5
    assert len(made.dwells) == 26 and stands_where_it_came(made)
    rest = plan_static_attitudes(ARM, StaticAttitudesSection(field_test_s=5), None, range(18))
    assert rest.steps == (), "nothing is left to hold between them"


def test_faces_are_held_by_their_name() -> None:
    made = plan(attitudes="faces", dwell_s=10, settle_s=2)
    assert sorted(map(wrists_deg, made.dwells)) == sorted(FACE_ATTITUDES)
    assert (made.settling_s, sum(dwell.duration_s for dwell in made.dwells)) == (24, 120)


@pytest.mark.slow
@pytest.mark.parametrize(("attitudes", "shortest_s"), [("eighteen", 20.64), ("faces", 16.25)])
def test_the_ways_through_the_stock_attitudes_are_the_shortest_there_are(attitudes: str, shortest_s: float) -> None:
    made = plan(attitudes=attitudes)
    places = np.array([HOME, *(dwell.q_rad for dwell in made.dwells)])
    farthest = np.abs(places[:, None] - places).max(axis=-1)
    between_s = np.vectorize(trapezoid_duration)(farthest, *np.radians([120, 240]))
    ways_s = sum(way.duration_s for way in made.motions)
    assert ways_s == pytest.approx(shortest_round(between_s)) == pytest.approx(shortest_s, abs=0.01)


def shortest_round(between: Array) -> float:
    """Over all orders, by dynamic programming over the sets of places visited (Held and Karp, 1962)."""
    count = len(between) - 1
    visited = np.arange(1 << count)
    sizes = sum((visited >> place) & 1 for place in range(count))
    best = np.full((1 << count, count), np.inf)
    for last in range(count):
        best[1 << last, last] = between[0, last + 1]
    for size, last in product(range(2, count + 1), range(count)):
        sets = visited[(sizes == size) & ((visited >> last) & 1 == 1)]
        best[sets, last] = (best[sets ^ (1 << last)] + between[1:, last + 1]).min(axis=1)
    return float((best[-1] + between[1:, 0]).min())


@pytest.mark.parametrize("seed", range(10))
def test_the_way_through_a_few_places_is_hardly_longer_than_the_shortest(seed: int) -> None:
    places = np.random.default_rng(seed).normal(size=(8, 3))
    between_s = np.abs(places[:, None] - places).max(axis=-1)

    def length(order: tuple[int, ...]) -> float:
        return float(sum(between_s[pair] for pair in pairwise((0, *order, 0))))

    found = shortest_way(between_s)
    assert sorted(found) == list(range(1, 8))
    assert length(found) <= 1.03 * min(map(length, permutations(range(1, 8))))


def test_one_attitude_has_a_way_too() -> None:
    made = plan(attitudes=[[10, -80, 5]], repeats=2)
    assert [type(step) for step in made.steps] == [Transfer, Dwell, Dwell, Transfer]
    assert [dwell.index for dwell in made.dwells] == [0, 1]


def test_repeats_are_counted_on_and_what_is_done_is_left_out() -> None:
    section = StaticAttitudesSection(attitudes=FACE_ATTITUDES, repeats=2)
    whole = plan_static_attitudes(ARM, section)
    assert [dwell.index for dwell in whole.dwells] == list(range(24))
    assert [dwell.q_rad for dwell in whole.dwells[12:]] == [dwell.q_rad for dwell in whole.dwells[:12]]
    start = (*HOME[:5], 0.5)
    rest = plan_static_attitudes(ARM, section, start, done=range(15))
    assert rest.dwells == whole.dwells[15:]
    assert rest.motions[0].name == "approach home" and stands_where_it_came(rest)
    assert plan_static_attitudes(ARM, section, done=range(24)).steps == ()


@pytest.mark.slow
def test_sweeps_and_attitudes_take_five_minutes_with_every_wait_for_settling() -> None:
    made = imu()
    assert (len(made.sweeps), len(made.dwells)) == (12, 18)
    assert made.duration_s < 205 and made.duration_s + made.settling_s < 300
    assert stands_where_it_came(made) and plan_problems(made, FlangeLoad(0.35)) == []


def test_sweeps_come_first_and_are_counted_first() -> None:
    made = imu(axes=3, repeats=2, attitudes="faces")
    assert [sweep.index for sweep in made.sweeps] == list(range(12))
    assert [dwell.index for dwell in made.dwells] == list(range(12, 36))
    kinds = [type(step) for step in made.steps]
    assert kinds.index(Dwell) > len(kinds) - 1 - kinds[::-1].index(Sweep)


def test_the_rest_of_an_interrupted_run_has_what_is_missing_of_both() -> None:
    section = ImuSection()
    rest = plan_imu(ARM, section, None, {*range(11), 12, 20})
    assert [sweep.index for sweep in rest.sweeps] == [11]
    assert [dwell.index for dwell in rest.dwells] == [index for index in range(13, 30) if index != 20]
    assert stands_where_it_came(rest)
    only_attitudes = plan_imu(ARM, section, None, range(12))
    assert not only_attitudes.sweeps and len(only_attitudes.dwells) == 18 and stands_where_it_came(only_attitudes)


@pytest.mark.parametrize(
    ("attitudes", "said"),
    [
        ("six", "is not a set of attitudes; allowed: eighteen, faces"),
        ([[0, -90, 0], [360, -90, 0]], "is listed twice"),
        ([[0, -90]], "Field required"),
        ([[0, -90, 400]], "less than or equal to 360"),
        ([], "at least 1 item"),
    ],
)
def test_what_are_no_attitudes_is_refused(attitudes: object, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        plan(attitudes=attitudes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (
            ["procedure.attitudes=[[0,-90,0],[90,-90,0],[180,-90,0],[-90,-90,0],[45,-90,0]]"],
            "5 attitudes determine 9 of the 14",
        ),
        (
            ["procedure.attitudes=[[0,-90,0],[90,-90,90],[-90,-90,45],[45,-90,20]]"],
            "4 attitudes determine 12 of the 14",
        ),
        (
            ["procedure.attitudes=[[0,-90,0],[90,-90,90],[-90,-90,45],[45,-90,20]]", "procedure.name=imu"],
            "12 of the 14",
        ),
        (["site.base_up=[0,1,0]"], "18 attitudes determine 11 of the 14"),  # wrist 1 turns about the vertical there
    ],
)
def test_attitudes_that_do_not_tell_enough_are_refused_before_anything_moves(overrides: list[str], said: str) -> None:
    config = load(CONFIGS / "attitudes.yaml", overrides).config
    phase = first_phase(load_procedures()[config.procedure.name], config, load_procedures())
    with pytest.raises(Refused, match=rf"rank_deficient: .*{said}"):
        phase.plan()


def test_attitudes_that_hardly_differ_about_one_wrist_are_refused() -> None:
    attitudes = [[wrist_1, -90, 0.1 * turn] for turn, wrist_1 in enumerate(range(-180, 180, 45))]
    config = load(CONFIGS / "attitudes.yaml", [f"procedure.attitudes={attitudes}"]).config
    with pytest.raises(Refused, match="ill_conditioned: 8 attitudes hardly determine"):
        first_phase(load_procedures()["static_attitudes"], config, load_procedures()).plan()


def test_what_is_left_of_an_interrupted_run_need_not_tell_everything() -> None:
    config = load(CONFIGS / "attitudes.yaml").config
    phase = first_phase(load_procedures()["static_attitudes"], config, load_procedures())
    assert len(phase.plan(None, range(17)).dwells) == 1
