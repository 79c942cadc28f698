"""What the page shows of the arm: its geometry, its name, how it stands."""

from dataclasses import asdict
from typing import Any

from rig.motion.geometry import NOMINAL, DenavitHartenberg
from rig.motion.state import JOINT_NAMES, ArmReport, ArmState, RobotMode, RuntimeState, SafetyMode
from rig.page.history import rounded
from rig.turners.ur.identity import model_found


def geometry(arm: DenavitHartenberg) -> dict[str, Any]:
    """An arm of which nothing is known but how it is built."""
    return {"geometry": asdict(arm), "joints": list(JOINT_NAMES), "q_rad": None, "missed": 0}


def connected(report: ArmReport) -> dict[str, Any]:
    """An arm that has answered."""
    known = {
        "model": model_found(report),
        "serial_number": report.serial_number,
        "host": report.host,
        "polyscope": report.polyscope,
    }
    return {**geometry(report.kinematics or NOMINAL), **known, **stance(report.state)}


def stance(state: ArmState) -> dict[str, Any]:
    """How an arm stood when it was seen; `let_go` where it stays so, for it stood and no program ran."""
    return {
        "q_rad": rounded(state.q_rad),
        "qd_rad_s": rounded(state.qd_rad_s),
        "slider": round(state.target_speed_fraction, 3),
        "scaling": round(state.speed_scaling, 3),
        "mode": _named(RobotMode, state.robot_mode),
        "safety": _named(SafetyMode, state.safety_mode),
        "program": _named(RuntimeState, state.runtime_state),
        "let_go": state.at_rest and state.runtime_state == RuntimeState.STOPPED,
    }


def _named(names: Any, number: int) -> str:
    try:
        return str(names(number).name).lower().replace("_", " ")
    except ValueError:
        return f"number {number}"
