"""Which arm answers, and whether it is the one that the configuration names. Pure.

Everything depends on it: how near a wrist comes to the forearm, how fast a joint may turn, what it carries. Controllers
tell the type by a number of the maker's (his client library, `RobotType`), which later models share with earlier ones
that are made alike; so the lengths decide as well, and the series, by the version of the software.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, get_args

import numpy as np

from rig.config.ranges import ModelName
from rig.errors import Problem
from rig.motion.geometry import LENGTHS, DenavitHartenberg, lengths_m
from rig.motion.model import TurnerModel, model_of, turner_model
from rig.turners.ur.report import ArmReport

if TYPE_CHECKING:
    from rig.config.models import ArmSection

E_SERIES, POLYSCOPE_X = 5, 10  # the first major versions of their software; the CB3 series has 3
POLYSCOPE_X_SINCE = (10, 10)  # older ones are not known to take programs and stops at their primary interface
E_SERIES_MODELS = {
    1: "UR5e or UR7e",  # made alike, for other payloads
    2: "UR10e or UR12e",  # made alike, for the same payload
    3: "UR3e",
    4: "UR16e",
    5: "UR18",
    6: "UR8 Long",
    7: "UR20",
    8: "UR30",
    9: "UR15",
}
CB3_MODELS = {1: "UR5", 2: "UR10", 3: "UR3"}
LENGTH_TOLERANCE_M = 0.01  # what factories find differs from the drawing by a few millimetres
OTHER_ARM = "Correct arm.host, or name the arm that is there in arm.model"


def version_text(version: tuple[int, ...]) -> str:
    """The version as the maker writes it, without the build."""
    return ".".join(map(str, version[:3]))


def model_found(report: ArmReport) -> str | None:
    """Which arm the controller says it is, in the maker's names; None where it does not tell.

    By its geometry or its dashboard where it does not tell the type.
    """
    models, robot_type = _models(report), _type_told(report)
    return None if robot_type is None else models.get(robot_type, f"arm of type {robot_type}")


def is_polyscope_x(version: tuple[int, ...]) -> bool:
    """Whether that software is a PolyScope X, which has no dashboard."""
    return version[:1] >= (POLYSCOPE_X,)


def series_problem(host: str, version: tuple[int, ...]) -> Problem | None:
    """A controller of another series, or of older software, than those the rig knows how to stop and to ask.

    One of the CB3 series is none where the configuration names an arm of it.
    """
    if is_polyscope_x(version) and version < POLYSCOPE_X_SINCE:
        since = ".".join(map(str, POLYSCOPE_X_SINCE))
        return Problem(
            "polyscope_x",
            f"the controller at {host} is a PolyScope X {version_text(version)}, and the rig can stop an arm "
            f"there only from {since} on",
            f"Update it to {since} or newer, or turn the sensors otherwise: docs/how-to/with-code/other-hardware.md",
        )
    if version[0] < E_SERIES:
        return Problem(
            "cb3_not_supported",
            f"the controller at {host} is one of the CB3 series (software {version_text(version)})",
            "Set arm.model: ur10_cb3 if it drives a UR10 and has software 3.15, or use an arm with PolyScope 5",
        )
    return None


def identity_problems(arm: "ArmSection", report: ArmReport) -> list[Problem]:
    """Whether the arm that answers is the one that was meant, by series, type and lengths: one problem, or none."""
    model, robot_type = model_of(arm), _type_told(report)
    if series := series_problem(report.host, report.version):
        if not (model.series == "CB3" and series.name == "cb3_not_supported"):
            return [series]
    elif model.series == "CB3":
        return [_other(arm, report, f"by its software, {version_text(report.version)}")]
    setup, kinematics = report.setup, report.kinematics
    told = [] if setup is None else [setup.drawing]
    if kinematics is not None and (setup is None or arm.kinematics == "controller"):
        told.append(kinematics)
    if not told and robot_type is None:
        return [
            Problem(
                "arm_not_identified",
                f"the controller at {report.host} does not say which arm it drives (primary interface, port 30001; "
                f"its dashboard: {report.called!r})",
                "Enable the primary interface in the arm's security settings",
            )
        ]
    if setup is not None and robot_type != model.robot_type:
        return [_other(arm, report, f"by its type, {robot_type}")]
    if not told and robot_type != model.robot_type:
        return [_other(arm, report, f"its dashboard: {report.called!r}")]
    return [_other(arm, report, why) for each in told if (why := _other_length(each, model)) is not None][:1]


def _models(report: ArmReport) -> Mapping[int, str]:
    """The arms of a controller's series, by type."""
    return E_SERIES_MODELS if report.version[0] >= E_SERIES else CB3_MODELS


def _type_told(report: ArmReport) -> int | None:
    """The type of arm: told as such, or else by the arm's lengths, or else by its name."""
    if report.setup is not None:
        return report.setup.robot_type
    if report.kinematics is not None:
        series = "CB3" if _models(report) is CB3_MODELS else "e-Series"
        known = (model for model in map(turner_model, get_args(ModelName)) if model.series == series)
        return next((model.robot_type for model in known if _other_length(report.kinematics, model) is None), None)
    called = (report.called or "").strip().upper()
    names = ((each, name.upper()) for each, words in _models(report).items() for name in words.split(" or "))
    return next((each for each, name in names if called in (name, name.removesuffix("E"))), None)


def _other_length(arm: DenavitHartenberg, model: TurnerModel) -> str | None:
    """What of it has most evidently another length than the model's, if something has."""
    lengths, nominal = lengths_m(arm), lengths_m(model.drawing)
    worst = int(np.argmax(np.abs(lengths - nominal)))
    if abs(lengths[worst] - nominal[worst]) <= LENGTH_TOLERANCE_M:
        return None
    return f"its {LENGTHS[worst]} is {lengths[worst]:.3f} m, a {model.name}'s {nominal[worst]:.3f} m"


def _other(arm: "ArmSection", report: ArmReport, why: str) -> Problem:
    found = model_found(report) or "arm that is not known"
    named = f"an {found}" if found.startswith("arm") else f"a {found}"
    what = f"the controller at {report.host} is {named}; configured is {arm.model} ({why})"
    return Problem("other_arm", what, OTHER_ARM)
