"""What the page shows of the arm: its geometry, its name, how it stands."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rig.motion.geometry import DenavitHartenberg
from rig.motion.state import JOINT_NAMES, ArmState, Report, RobotMode, RuntimeState, SafetyMode, State
from rig.page.history import rounded


def built(chain: DenavitHartenberg) -> dict[str, Any]:
    """How a turner is built, and how long its links are together, m, from joint to joint across the axes."""
    return {"geometry": asdict(chain), "long_m": sum(map(abs, chain.a_m))}


def geometry(chain: DenavitHartenberg, joints: Sequence[str] = JOINT_NAMES) -> dict[str, Any]:
    """A turner of which nothing is known but how it is built."""
    return {**built(chain), "joints": list(joints), "q_rad": None, "missed": 0}


def connected(report: Report) -> dict[str, Any]:
    """A turner that has answered; how it is built where it says so."""
    known = {
        "model": report.model,
        "serial_number": report.serial_number,
        "host": report.host,
        "polyscope": report.software,
    }
    told = {} if report.kinematics is None else built(report.kinematics)
    return {**told, "joints": list(report.joints), **known, **stance(report.state), "missed": 0}


def stance(state: State) -> dict[str, Any]:
    """How a turner stood when it was seen; `let_go` where it stays so, for it stood and no program ran."""
    seen = {"q_rad": rounded(state.q_rad), "qd_rad_s": rounded(state.qd_rad_s)}
    if not isinstance(state, ArmState):
        return {**seen, "let_go": False}
    return {
        **seen,
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
