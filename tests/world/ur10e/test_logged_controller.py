"""The simulated controller does what logs and the maker's clients show of real ones, beside its joints."""

import json
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from rig.world.ur10e.interfaces.dashboard_server import DashboardSession
from rig.world.ur10e.interfaces.robot_api_server import RobotApiSession
from rig.world.ur10e.interfaces.stored_programs import StoredPrograms
from rig.world.ur10e.modes import RobotMode, SafetyMode
from support.motions.arm_states import LoggedArm

CB3_ONLY = ["setUserRole programmer", "getUserRole"]
NOT_CB3 = [
    "version", "safetystatus", "get operational mode", "set operational mode manual", "clear operational mode",
    "is in remote control",
]  # fmt: skip


# -- programs ------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_the_speed_scaling_is_zero_while_no_program_runs() -> None:
    arm = LoggedArm()
    arm.log(50)
    assert not arm.take()["speed_scaling"].any()
    arm.run("def wait():\n  sleep(0.2)\nend")
    arm.log(200)
    scaling = arm.take()["speed_scaling"]
    assert scaling[60] == 1.0 and scaling[0] == scaling[-1] == 0.0


def log_of(script: str) -> dict[str, np.ndarray]:
    arm = LoggedArm(["world.arm.joints=ideal"])
    arm.log_move(script)
    return arm.take()


MOVE = "movej([1.0, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0], a=1.0, v=0.8)"


@pytest.mark.slow
def test_a_lone_move_starts_gently_and_one_inside_a_program_does_not() -> None:
    """Its speed grows with the third power of time for 0.152 s; then it is 0.076 s later than the other."""
    gentle, plain = log_of(MOVE), log_of(f"def move():\n  {MOVE}\n  sleep(0.1)\nend")
    starts = [int(np.flatnonzero(log["target_qd"][:, 0])[0]) for log in (gentle, plain)]
    speeds = [log["target_qd"][start - 1 :, 0] for log, start in zip((gentle, plain), starts, strict=True)]
    assert speeds[0][76] == pytest.approx(0.076, abs=1e-3)
    assert speeds[0][38] / speeds[0][76] == pytest.approx(0.5**3, abs=0.02)
    assert gentle["target_qdd"][starts[0] + 72, 0] == pytest.approx(1.38, abs=0.02)
    assert speeds[1][10] == pytest.approx(0.020, abs=1e-9)
    ends = [int(np.flatnonzero(speed)[-1]) for speed in speeds]
    assert (ends[0] - ends[1]) * 0.002 == pytest.approx(0.076, abs=0.004)
    for log in (gentle, plain):
        assert log["actual_q"][-1, 0] == pytest.approx(1.0, abs=1e-12)
        assert log["target_qdd"][:, 0].min() == pytest.approx(-1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("distance", "speed"),
    [(0.001, 1.0), (0.006, 0.05), (0.006, 1.0), (0.03, 0.05), (0.03, 3.0), (2.0, 1.0), (2.0, 3.0)],
)
def test_a_lone_move_of_any_length_ends_on_target_without_a_jump(distance: float, speed: float) -> None:
    log = log_of(f"movej([{distance}, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0], a=1.4, v={speed})")
    assert log["target_q"][-1, 0] == pytest.approx(distance, abs=1e-12)
    assert max(abs(b - a) for a, b in pairwise(log["target_qd"][:, 0])) <= 1.5 * 1.4 * 0.002
    assert np.gradient(log["target_q"][:, 0], 0.002) == pytest.approx(log["target_qd"][:, 0], abs=4e-3)


# -- power and safety ----------------------------------------------------------------------------------------------
def test_an_arm_may_start_elsewhere_than_home() -> None:
    arm = LoggedArm(["world.arm.start_deg=[10, -80, 70, -100, -95, 200]", "world.arm.joints=ideal"])
    assert np.degrees(arm.robot.motion.q_rad) == pytest.approx([10, -80, 70, -100, -95, 200])


def test_unlocking_a_protective_stop_takes_its_time() -> None:
    arm = LoggedArm()
    arm.robot.protective_stop()
    arm.log(2600)
    assert DashboardSession(arm.robot).answer("unlock protective stop") == "Protective stop releasing"
    arm.log(100)
    assert arm.robot.safety_mode.name == "PROTECTIVE_STOP"
    assert not arm.robot.waiting
    arm.log(400)
    assert arm.robot.safety_mode.name == "NORMAL"


def test_a_stop_during_the_unlocking_is_another_one() -> None:
    arm = LoggedArm()
    arm.robot.protective_stop()
    arm.robot.unlock_protective_stop()
    arm.log(10)
    arm.robot.emergency_stop()
    arm.log(500)
    assert arm.robot.safety_mode == SafetyMode.ROBOT_EMERGENCY_STOP


# -- interfaces ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("command", [*NOT_CB3, *CB3_ONLY])
def test_a_dashboard_has_the_commands_of_its_series(command: str) -> None:
    cb3, e_series = (
        DashboardSession(LoggedArm([f"world.arm.polyscope={version}"]).robot).answer(command)
        for version in ("3.15.8.0", "5.14.0.0")
    )
    lacking, having = (cb3, e_series) if command in NOT_CB3 else (e_series, cb3)
    assert lacking.startswith("could not understand")
    assert not having.startswith("could not understand")


class Api:
    """The Robot API of a PolyScope X, asked as the maker's client does."""

    def __init__(self, polyscope: str = "10.12.0.0") -> None:
        self.arm = LoggedArm([f"world.arm.polyscope={polyscope}"])
        self.programs = StoredPrograms()

    def ask(self, method: str, path: str, body: str = "") -> tuple[int, dict[str, object]]:
        """Status and body of an exchange, for whose answer the client waits."""
        session = RobotApiSession(self.arm.robot, self.programs)
        head = f"{method} /universal-robots/robot-api{path} HTTP/1.1\r\nContent-Length: {len(body)}\r\n\r\n"
        answer = session.receive(head.encode() + body.encode())
        while not answer:
            self.arm.log(1)
            answer = session.tick()
        assert session.closing
        head_line, _, content = answer.partition(b"\r\n\r\n")
        return int(head_line.split()[1]), json.loads(content)

    def get(self, path: str) -> dict[str, Any]:
        status, body = self.ask("GET", path)
        assert status == 200
        return body

    def put(self, path: str, **body: str) -> int:
        return self.ask("PUT", path, json.dumps(body))[0]


def test_the_makers_client_connects_to_the_robot_api() -> None:
    assert Api().get("/openapi.json")["info"] == {"title": "Robot API", "version": "3.1.4"}
    assert Api("10.11.0.0").get("/openapi.json")["info"] == {"title": "Robot API", "version": "3.0.0"}
    assert Api("10.11.0.0").ask("GET", "/robotstate/v1/robotmode")[0] == 404


def test_the_robot_api_switches_the_arm_off_and_on_and_answers_when_that_is_done() -> None:
    api = Api()
    assert api.put("/robotstate/v1/state", action="POWER_OFF") == 200
    assert api.get("/robotstate/v1/robotmode") == {"mode": "POWER_OFF"}
    assert api.put("/robotstate/v1/state", action="POWER_ON") == 200
    assert api.arm.robot.robot_mode == RobotMode.IDLE
    assert api.put("/robotstate/v1/state", action="BRAKE_RELEASE") == 200
    assert api.get("/robotstate/v1/robotmode") == {"mode": "RUNNING"}
    assert api.put("/robotstate/v1/state", action="DANCE") == 400


def test_the_robot_api_unlocks_a_protective_stop() -> None:
    api = Api()
    api.arm.robot.protective_stop()
    assert api.get("/robotstate/v1/safetymode") == {"mode": "PROTECTIVE_STOP"}
    assert api.put("/robotstate/v1/state", action="UNLOCK_PROTECTIVE_STOP") == 200
    assert api.get("/robotstate/v1/safetymode") == {"mode": "NORMAL"}


def test_the_robot_api_plays_a_loaded_program() -> None:
    api, state = Api(), "/program/v1/state"
    assert api.get("/program/v1/loaded") == {"name": "Default program"}
    assert api.put("/program/v1/loaded", name="no such program") == 404
    assert api.put("/program/v1/loaded", name="wait_program") == 200
    assert api.get("/program/v1/loaded") == {"name": "wait_program"}
    for action, expected in (("play", "PLAYING"), ("pause", "PAUSED"), ("resume", "PLAYING"), ("stop", "STOPPED")):
        assert api.put(state, action=action) == 200
        assert api.get(state) == {"state": expected}


def test_the_robot_api_stores_programs() -> None:
    api, path = Api(), "/programs/v1/"
    document = json.dumps({"program": {"programInformation": {"name": "test upload"}}})
    form = f'--b\r\nContent-Disposition: form-data; name="file"\r\n\r\n{document}\r\n--b--\r\n'
    assert api.ask("PUT", path, form)[0] == 400
    assert api.ask("POST", path, form) == (200, {"programName": "test upload"})
    assert api.ask("POST", path, form)[0] == 400
    assert api.ask("PUT", path, form)[0] == 200
    assert api.get("/programs/v1/test%20upload") == json.loads(document)
    assert api.ask("GET", "/programs/v1/another")[0] == 404
    assert [program["name"] for program in api.get(path)["programs"]][-1] == "test upload"


def test_the_robot_api_says_the_operational_mode_and_takes_no_order_in_local_control() -> None:
    api = Api()
    assert api.get("/system/v1/operationalmode") == {"mode": "AUTOMATIC"}
    api.arm.robot.remote_control = False
    assert api.get("/system/v1/operationalmode") == {"mode": "MANUAL"}
    for path in ("/robotstate/v1/state", "/program/v1/state"):
        assert api.put(path, action="stop") == 403
