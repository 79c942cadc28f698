"""The arm on the page: its geometry, its name, its state."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rig.motion.chain import DenavitHartenberg
from rig.motion.turner_state import JOINT_NAMES, ArmState, Report, RobotMode, RuntimeState, SafetyMode, State
from rig.page.recent_readings import round_digits


def built(chain: DenavitHartenberg) -> dict[str, Any]:
    """Return a turner's geometry, and the total length of its links, m."""
    return {"geometry": asdict(chain), "long_m": sum(map(abs, chain.a_m))}


def geometry(chain: DenavitHartenberg, joints: Sequence[str] = JOINT_NAMES) -> dict[str, Any]:
    """Return the page section of a turner that is not connected yet, which has only its geometry."""
    return {**built(chain), "joints": list(joints), "q_rad": None, "missed": 0}


def turner_section(report: Report) -> dict[str, Any]:
    """Return the page section of a connected turner, with its geometry if the turner reports one."""
    names = {
        "model": report.model,
        "serial_number": report.serial_number,
        "host": report.host,
        "polyscope": report.software,
    }
    chain = {} if report.kinematics is None else built(report.kinematics)
    return {**chain, "joints": list(report.joints), **names, **stance(report.state), "missed": 0}


def stance(state: State) -> dict[str, Any]:
    """Return a turner's last state; a turner at rest without a program is `let_go`."""
    joints = {"q_rad": round_digits(state.q_rad), "qd_rad_s": round_digits(state.qd_rad_s)}
    if not isinstance(state, ArmState):
        return {**joints, "let_go": False}
    return {
        **joints,
        "slider": round(state.target_speed_fraction, 3),
        "scaling": round(state.speed_scaling, 3),
        "mode": _name_of(RobotMode, state.robot_mode),
        "safety": _name_of(SafetyMode, state.safety_mode),
        "program": _name_of(RuntimeState, state.runtime_state),
        "let_go": state.at_rest and state.runtime_state == RuntimeState.STOPPED,
    }


def _name_of(names: Any, number: int) -> str:
    try:
        return str(names(number).name).lower().replace("_", " ")
    except ValueError:
        return f"number {number}"
