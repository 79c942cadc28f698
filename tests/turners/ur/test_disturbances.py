"""What takes the arm out of the rig's hands while it is under control: named at once, and the stop told as it was.

On every generation of controllers where it applies; by `make test` on one of them, by `make proof` on all.
"""

import math
import multiprocessing
import os
import signal
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from rig.errors import Fault, Refused
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Transfer, trapezoid_duration
from rig.motion.turner_state import ArmState, Joints
from rig.turners.ur.arm_driver import Arm, look
from support.laboratories.worlds import World, WorldHandle, merge
from support.processes.waiting import wait_for

pytestmark = pytest.mark.slow

PAYLOAD = FlangeLoad(0.35, (0.0, 0.0, 0.025))
WRIST_3 = 5
API_PORT = 8077
X: dict[str, Any] = {"arm": {"robot_api_port": API_PORT}, "world": {"arm": {"polyscope": "10.14.0.0"}}}
GENERATIONS: dict[str, dict[str, Any]] = {
    "CB3": {"arm": {"model": "ur10_cb3"}},
    "PolyScope 5": {},
    "PolyScope 5.23": {"world": {"arm": {"polyscope": "5.23.0.0"}}},
    "PolyScope X": X,
    "PolyScope X that does not tell its control mode": merge(X, {"world": {"arm": {"polyscope": "10.10.0.0"}}}),
}
LATER = [pytest.mark.proof, pytest.mark.thorough]
PENDANTS = ("PolyScope 5", "PolyScope X", "PolyScope X that does not tell its control mode")  # they know local control

Order = dict[str, Any]
Watch = Callable[[], None]


def on(first: str, *names: str) -> pytest.MarkDecorator:
    """A test for each of these generations, the first of them by `make test` too."""
    later = [pytest.param(name, marks=LATER) for name in names]
    return pytest.mark.parametrize("laboratory", [first, *later], indirect=True)


on_all = on("PolyScope 5", "CB3", *PENDANTS[1:])


@pytest.fixture
def laboratory(world: World, request: pytest.FixtureRequest) -> WorldHandle:
    return world(merge(GENERATIONS[request.param], {"world": {"time_scale": 4}}))


def connected(laboratory: WorldHandle, on_state: Callable[[ArmState], None] = lambda state: None) -> Arm:
    return Arm(laboratory.host, on_state, robot_api_port=API_PORT)


def turn(start: Joints, angle_rad: float) -> Transfer:
    """A move of wrist 3 alone at 1 rad/s."""
    target = (*start[:WRIST_3], start[WRIST_3] + angle_rad)
    return Transfer("test move", start, target, 1.0, 2.0, trapezoid_duration(abs(angle_rad), 1.0, 2.0))


def once(arm: Arm, act: Callable[[], object], *, moving: bool = True) -> Watch:
    """A watch that acts once: when wrist 3 has its speed, or at once in a rest."""
    acted = False

    def watch() -> None:
        nonlocal acted
        if not acted and (not moving or abs(arm.latest.qd_rad_s[WRIST_3]) > 0.8):
            acted = True
            act()

    return watch


def disturbed(
    laboratory: WorldHandle, order: Order, moment: str, on_state: Callable[[ArmState], None] = lambda state: None
) -> Fault:
    """The fault that an order to the world brings about, in a move or in a rest; the arm stands then."""
    with connected(laboratory, on_state) as arm:
        arm.take_control(PAYLOAD)
        with pytest.raises(Fault) as fault:
            if moment == "move":
                arm.move(turn(arm.latest.q_rad, 6.0), once(arm, lambda: laboratory.control(order)))
            else:
                arm.rest(120.0, once(arm, lambda: laboratory.control(order), moving=False))
        assert moment in fault.value.what or "test move" in fault.value.what
        wait_for(lambda: not laboratory.state()["moving"], "rest")
    return fault.value


@pytest.mark.parametrize("moment", ["move", pytest.param("rest", marks=LATER)])
@on(*PENDANTS)
def test_local_control_ends_the_run_at_once_by_the_client_and_says_who_refused(
    laboratory: WorldHandle, moment: str
) -> None:
    fault = disturbed(laboratory, {"do": "remote_control", "on": False}, moment)
    assert fault.name == "switched_to_local_control"
    assert "the arm is stopped and at rest" in fault.what and "refused the stop" in fault.what
    assert "remote control" in fault.remedy
    assert laboratory.state()["q_rad"][WRIST_3] < 5.0, "the arm went on to the end of its way"


@pytest.mark.thorough
@on("CB3")
def test_a_controller_without_local_control_has_nothing_to_switch(laboratory: WorldHandle) -> None:
    with connected(laboratory) as arm:
        arm.take_control(PAYLOAD)
        arm.move(turn(arm.latest.q_rad, 2.0), once(arm, lambda: laboratory.control({"do": "remote_control", "on": 0})))
        assert arm.stop().what == "the arm is stopped and at rest"


@on(*PENDANTS)
def test_a_stop_that_every_port_refuses_is_not_confirmed_and_told_with_the_controllers_words(
    laboratory: WorldHandle,
) -> None:
    """The client's process hangs in the moment in which the pendant is switched: the arm goes on to its end."""
    others = set(multiprocessing.active_children())
    with connected(laboratory) as arm:
        arm.take_control(PAYLOAD)
        (child,) = set(multiprocessing.active_children()) - others

        def hang_and_switch() -> None:
            os.kill(child.pid or 0, signal.SIGSTOP)
            laboratory.control({"do": "remote_control", "on": False})

        with pytest.raises(Fault) as fault:
            arm.move(turn(arm.latest.q_rad, 6.0), once(arm, hang_and_switch))
    said = fault.value
    assert said.name in ("switched_to_local_control", "arm_driver_hung")
    assert "the stop is not confirmed: " in said.what and "at rest" not in said.what.split("no state shows")[0]
    refusing = 'dashboard refused the stop ("Command is not allowed due to safety reasons'
    refusing = "primary interface refused the stop (C210A0" if "primary interface refused" in said.what else refusing
    assert refusing in said.what and "the client has not answered it" in said.what, said.what
    assert "press the emergency stop if it moves" in said.remedy
    wait_for(lambda: laboratory.state()["q_rad"][WRIST_3] > 5.9, "the end of the movement")


@pytest.mark.thorough
@pytest.mark.parametrize("moment", ["move", pytest.param("rest", marks=LATER)])
@on_all
def test_another_payload_ends_the_run_at_once(laboratory: WorldHandle, moment: str) -> None:
    fault = disturbed(laboratory, {"do": "payload", "mass_kg": 1.5}, moment)
    assert fault.name == "payload_changed"
    assert "1.5 kg at (0, 0, 25) mm instead of 0.35 kg" in fault.what and "gripper" in fault.remedy


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("seconds", "moment"),
    [(1.0, "rest"), (-0.5, "move"), *(pytest.param(*each, marks=LATER) for each in [(1.0, "move"), (-0.5, "rest")])],
)
@on_all
def test_a_clock_that_is_set_ends_the_run_at_once_and_its_states_are_not_passed_on(
    laboratory: WorldHandle, seconds: float, moment: str
) -> None:
    states: list[ArmState] = []
    fault = disturbed(laboratory, {"do": "step_clock", "seconds": seconds}, moment, states.append)
    assert fault.name == "arm_clock_stepped" and "its clock was set" in fault.what
    assert "the arm is stopped and at rest" in fault.what
    assert all(0.0 < b.time_s - a.time_s < 0.1 for a, b in pairwise(states))


@pytest.mark.thorough
@pytest.mark.parametrize("moment", ["move"])
@on_all
def test_a_safety_limit_that_slows_the_arm_is_no_slider(laboratory: WorldHandle, moment: str) -> None:
    fault = disturbed(laboratory, {"do": "safety_limit", "fraction": 0.6}, moment)
    assert fault.name == "speed_limited" and "with the speed slider at 100 %" in fault.what
    assert "safety settings" in fault.remedy and "slider" not in fault.remedy


@pytest.mark.parametrize(
    ("error_rad", "said", "moment"),
    [
        (math.tau, "wrist_1 went by", "move"),
        pytest.param(math.nan, "wrist_1 is nan", "rest", marks=LATER),
        pytest.param(math.inf, "wrist_1 is inf", "move", marks=LATER),
    ],
    ids=["a turn", "no number", "infinity"],
)
@on_all
def test_states_that_no_arm_is_in_are_no_lost_link(
    laboratory: WorldHandle, error_rad: float, said: str, moment: str
) -> None:
    fault = disturbed(laboratory, {"do": "encoder", "joint": 3, "error_rad": error_rad}, moment)
    assert fault.name == "arm_state_impossible" and said in fault.what and "cable" not in fault.remedy


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("mode", "remedy"), [("UPDATING_FIRMWARE", "Wait until"), pytest.param("DISCONNECTED", "cable", marks=LATER)]
)
@on_all
def test_an_arm_that_leaves_its_operation_is_told_what_to_wait_for(
    laboratory: WorldHandle, mode: str, remedy: str
) -> None:
    fault = disturbed(laboratory, {"do": "robot_mode", "name": mode}, "move")
    assert fault.name == "arm_not_running" and mode in fault.what and remedy in fault.remedy


@on("PolyScope 5", "PolyScope X")
def test_a_run_goes_on_without_one_port_and_ends_without_all(laboratory: WorldHandle) -> None:
    is_x = look(laboratory.host, API_PORT).version[0] == 10
    with connected(laboratory) as arm:
        arm.take_control(PAYLOAD)
        if not is_x:
            laboratory.control({"do": "close_dashboard"})
            arm.move(turn(arm.latest.q_rad, 2.0))
        with pytest.raises(Fault) as fault:
            arm.rest(60.0, once(arm, lambda: laboratory.control({"do": "close_primary"}), moving=False))
    assert fault.value.name == "stop_ports_closed"
    assert not laboratory.state()["program_running"]


# -- the preparation: from the start of the program until the payload shows ------------------------------------------


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("name", "then", "after_s"),
    [
        ("program_stopped", {"do": "stop_program"}, 0.3),
        pytest.param("program_stopped", {"do": "stop_program"}, 0.0, marks=LATER),
        pytest.param("program_stopped", {"do": "stop_program"}, 0.02, marks=LATER),
        ("protective_stop", {"do": "protective_stop"}, 0.3),
        pytest.param("protective_stop", {"do": "protective_stop"}, 0.0, marks=LATER),
        pytest.param("emergency_stop", {"do": "emergency_stop"}, 0.3, marks=LATER),
        pytest.param("safeguard_stop", {"do": "safeguard_stop"}, 0.3, marks=LATER),
        pytest.param("arm_paused", {"do": "pause"}, 0.3, marks=LATER),
        pytest.param("arm_not_running", {"do": "power_off"}, 0.3, marks=LATER),
        pytest.param("speed_slider", {"do": "speed_slider", "fraction": 0.5}, 0.3, marks=LATER),
        pytest.param("arm_link_lost", {"do": "close_arm"}, 0.3, marks=LATER),
        pytest.param("arm_link_lost", {"do": "silence_arm", "duration_s": 30.0}, 0.3, marks=LATER),
    ],
)
@on("PolyScope 5", "CB3", "PolyScope X")
def test_what_ends_the_preparation_has_its_own_name(
    laboratory: WorldHandle, name: str, then: Order, after_s: float
) -> None:
    """Nothing has moved, so it is a refusal; what a fieldbus adapter does that has lost its connection comes so."""
    with connected(laboratory) as arm:
        laboratory.control({"do": "payload_stays", "on": True})
        laboratory.control({"do": "at_program_start", "then": then, "after_s": after_s})
        with pytest.raises(Refused) as refused:
            arm.take_control(PAYLOAD)
    assert refused.value.name == name, refused.value
    assert name != "program_stopped" or "fieldbus" in refused.value.remedy
    assert laboratory.state()["still_since_s"] == 0.0, "something has moved"


@on("PolyScope 5", "PolyScope X")
def test_local_control_in_the_preparation_is_named_so(laboratory: WorldHandle) -> None:
    with connected(laboratory) as arm:
        then = {"do": "remote_control", "on": False}
        laboratory.control({"do": "payload_stays", "on": True})
        laboratory.control({"do": "pace", "time_scale": 0.5})  # the control mode is asked by this computer's clock
        laboratory.control({"do": "at_program_start", "then": then, "after_s": 0.02})
        with pytest.raises(Refused) as refused:
            arm.take_control(PAYLOAD)
    assert refused.value.name == "switched_to_local_control", refused.value


# -- registers ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("first", "last", "used"), [(0, 23, 24), pytest.param(24, 47, 0, marks=LATER)])
@on("PolyScope 5", "CB3")
def test_the_half_of_the_registers_that_is_free_is_used(
    laboratory: WorldHandle, first: int, last: int, used: int
) -> None:
    laboratory.control({"do": "registers_in_use", "first": first, "last": last})
    with connected(laboratory) as arm:
        arm.take_control(PAYLOAD)
        ours = [name for name in laboratory.state()["claims"] if not first <= int(name.rsplit("_", 1)[1]) <= last]
        assert min(int(name.rsplit("_", 1)[1]) for name in ours) == used
        arm.move(turn(arm.latest.q_rad, 1.0))
        assert arm.stop().at_rest


@pytest.mark.thorough
@on("PolyScope X", "PolyScope 5.23")
def test_where_the_client_knows_the_lower_half_alone_that_one_must_be_free(laboratory: WorldHandle) -> None:
    laboratory.control({"do": "registers_in_use", "first": 24, "last": 47})
    assert look(laboratory.host, API_PORT).registers_free
    with connected(laboratory) as arm:
        arm.take_control(PAYLOAD)
    laboratory.control({"do": "register_in_use"})
    assert look(laboratory.host, API_PORT).registers_free is False
    with connected(laboratory) as arm, pytest.raises(Refused) as refused:
        arm.take_control(PAYLOAD)
    assert refused.value.name == "registers_in_use" and "0-23, of which the client needs some" in refused.value.what


@pytest.mark.thorough
@on_all
def test_a_look_finds_registers_taken_and_takes_none(laboratory: WorldHandle) -> None:
    assert look(laboratory.host, API_PORT).registers_free
    assert laboratory.state()["claims"] == []
    for name in ("input_int_register_3", "input_double_register_40"):  # one in either half
        laboratory.control({"do": "register_in_use", "name": name})
    assert look(laboratory.host, API_PORT).registers_free is False
    with connected(laboratory) as arm, pytest.raises(Refused) as refused:
        arm.take_control(PAYLOAD)
    assert refused.value.name == "registers_in_use"
    assert all(owner in refused.value.remedy for owner in ("EtherNet/IP", "PROFINET", "gripper"))
