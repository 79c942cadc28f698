"""The check that the arm that answers is the configured one. Pure.

All limits depend on the model: the clearance between wrist and forearm, joint speeds, payload. Controllers report the
type as a number (the maker's client library, `RobotType`), which later models share with earlier ones of the same
construction. So the lengths are compared too, and the series by the software's version.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, get_args

from rig.config.ranges import ModelName
from rig.errors import Problem
from rig.motion.chain import DenavitHartenberg
from rig.motion.model import TurnerModel, load_turner_model, model_of
from rig.turners.ur.arm_report import ArmReport

if TYPE_CHECKING:
    from rig.config.models import ArmSection

E_SERIES, POLYSCOPE_X = 5, 10  # first major versions of their software; the CB3 series has 3
POLYSCOPE_X_MIN_VERSION = (10, 10)  # earlier versions may not take programs and stops at their primary interface
E_SERIES_MODELS = {
    1: "UR5e or UR7e",  # same construction, different payloads
    2: "UR10e or UR12e",  # same construction, same payload
    3: "UR3e",
    4: "UR16e",
    5: "UR18",
    6: "UR8 Long",
    7: "UR20",
    8: "UR30",
    9: "UR15",
}
CB3_MODELS = {1: "UR5", 2: "UR10", 3: "UR3"}
LENGTH_TOLERANCE_M = 0.01  # a factory's measurement differs from nominal by a few millimetres
OTHER_ARM_REMEDY = "Correct arm.host, or name the arm that is there in arm.model"


def version_text(version: tuple[int, ...]) -> str:
    """Return the version in the maker's form, without the build."""
    return ".".join(map(str, version[:3]))


def identify_model(report: ArmReport) -> str | None:
    """Return the maker's name of the arm that the controller reports; None if the arm is unknown.

    If the controller does not report the arm's type, the geometry or the dashboard's name decides.
    """
    models, robot_type = _models(report), _robot_type(report)
    return None if robot_type is None else models.get(robot_type, f"arm of type {robot_type}")


def is_polyscope_x(version: tuple[int, ...]) -> bool:
    """Return whether software of this version is a PolyScope X, which has no dashboard."""
    return version[:1] >= (POLYSCOPE_X,)


def series_problem(host: str, version: tuple[int, ...]) -> Problem | None:
    """Return the problem of a controller of another series, or of software too old to stop its arm; else None.

    `identity_problems` disregards `cb3_not_supported` if an arm of the CB3 series is configured.
    """
    if is_polyscope_x(version) and version < POLYSCOPE_X_MIN_VERSION:
        since = ".".join(map(str, POLYSCOPE_X_MIN_VERSION))
        return Problem(
            "polyscope_x",
            f"the controller at {host} is a PolyScope X {version_text(version)}, and the rig can stop an arm "
            f"there only since version {since}",
            f"Update it to {since} or newer, or turn the sensors by a servo or by hand: `rig new FILE` writes that",
        )
    if version[0] < E_SERIES:
        return Problem(
            "cb3_not_supported",
            f"the controller at {host} is one of the CB3 series (software {version_text(version)})",
            "Set arm.model: ur10_cb3 if it drives a UR10 and has software 3.15, or use an arm with PolyScope 5",
        )
    return None


def identity_problems(arm: "ArmSection", report: ArmReport) -> list[Problem]:
    """Compare the connected arm with the configured one, by series, type and lengths; return at most one problem."""
    model, robot_type = model_of(arm), _robot_type(report)
    if series := series_problem(report.host, report.version):
        if not (model.series == "CB3" and series.name == "cb3_not_supported"):
            return [series]
    elif model.series == "CB3":
        return [_mismatch(arm, report, f"by its software, {version_text(report.version)}")]
    setup, kinematics = report.setup, report.kinematics
    chains = [] if setup is None else [setup.nominal]
    if kinematics is not None and (setup is None or arm.kinematics == "controller"):
        chains.append(kinematics)
    if not chains and robot_type is None:
        return [
            Problem(
                "arm_not_identified",
                f"the controller at {report.host} does not say which arm it drives (primary interface, port 30001; "
                f"its dashboard: {report.called!r})",
                "Enable the primary interface in the arm's security settings",
            )
        ]
    if setup is not None and robot_type != model.robot_type:
        return [_mismatch(arm, report, f"by its type, {robot_type}")]
    if not chains and robot_type != model.robot_type:
        return [_mismatch(arm, report, f"its dashboard: {report.called!r}")]
    return [_mismatch(arm, report, why) for chain in chains if (why := _other_length(chain, model)) is not None][:1]


def _models(report: ArmReport) -> Mapping[int, str]:
    """Return the models of a controller's series, by type."""
    return E_SERIES_MODELS if report.version[0] >= E_SERIES else CB3_MODELS


def _robot_type(report: ArmReport) -> int | None:
    """Return the type of arm as reported, or else by the arm's lengths, or else by its name; None if unknown."""
    if report.setup is not None:
        return report.setup.robot_type
    if report.kinematics is not None:
        series = "CB3" if _models(report) is CB3_MODELS else "e-Series"
        models = (model for model in map(load_turner_model, get_args(ModelName)) if model.series == series)
        return next((model.robot_type for model in models if _other_length(report.kinematics, model) is None), None)
    called = (report.called or "").strip().upper()
    names = ((number, name.upper()) for number, words in _models(report).items() for name in words.split(" or "))
    return next((number for number, name in names if called in (name, name.removesuffix("E"))), None)


def _other_length(arm: DenavitHartenberg, model: TurnerModel) -> str | None:
    """Return a sentence on the length that differs most from the model's; None if all are within tolerance."""
    import numpy as np  # here, because the process of the arm's client must start fast and needs no arrays

    from rig.motion.geometry import LENGTHS, lengths_m

    lengths, nominal = lengths_m(arm), lengths_m(model.nominal)
    worst = int(np.argmax(np.abs(lengths - nominal)))
    if abs(lengths[worst] - nominal[worst]) <= LENGTH_TOLERANCE_M:
        return None
    return f"its {LENGTHS[worst]} is {lengths[worst]:.3f} m, a {model.name}'s {nominal[worst]:.3f} m"


def _mismatch(arm: "ArmSection", report: ArmReport, why: str) -> Problem:
    model = identify_model(report) or "arm that is not known"
    with_article = f"an {model}" if model.startswith("arm") else f"a {model}"
    what = f"the controller at {report.host} is {with_article}; configured is {arm.model} ({why})"
    return Problem("other_arm", what, OTHER_ARM_REMEDY)
