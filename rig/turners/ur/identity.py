"""Which arm answers, and whether it is the one that the rig knows how to move: a UR10e. Pure.

Everything depends on it: how near a wrist comes to the forearm, how fast a joint may turn, what it carries. Controllers
tell the type by a number of the maker's (his client library, `RobotType`), which later models share with earlier ones
that are made alike; so the lengths decide, and the series, by the version of the software.
"""

import numpy as np

from rig.config.models import ArmSection
from rig.errors import Problem
from rig.motion.geometry import LENGTHS, NOMINAL, DenavitHartenberg, lengths_m
from rig.motion.state import ArmReport

E_SERIES, POLYSCOPE_X = 5, 10  # the first major versions of their software; the CB3 series has 3
UR10 = 2
E_SERIES_MODELS = {
    1: "UR5e or UR7e",
    UR10: "UR10e or UR12e",  # made alike, for the same payload
    3: "UR3e",
    4: "UR16e",
    5: "UR18",
    6: "UR8 Long",
    7: "UR20",
    8: "UR30",
    9: "UR15",
}
CB3_MODELS = {1: "UR5", UR10: "UR10", 3: "UR3"}
DASHBOARD_NAMES = ("UR10", "UR10E", "UR12E")
LENGTH_TOLERANCE_M = 0.01  # what factories find differs from the drawing by a few millimetres
OTHER_ARM = (
    "Correct arm.host, or mount the sensors on a UR10e or UR12e: no other arm's clearances and limits are known here"
)


def version_text(version: tuple[int, ...]) -> str:
    """The version as the maker writes it, without the build."""
    return ".".join(map(str, version[:3]))


def model_found(report: ArmReport) -> str | None:
    """Which arm the controller says it is, in the maker's names; None where it does not tell.

    By its geometry or its dashboard where it does not tell the type.
    """
    models = E_SERIES_MODELS if report.version[0] >= E_SERIES else CB3_MODELS
    if report.setup is not None:
        return models.get(report.setup.robot_type, f"arm of type {report.setup.robot_type}")
    made_so = report.kinematics is not None and _other_length(report.kinematics) is None
    return models[UR10] if made_so or _called_ur10(report) else None


def series_problem(host: str, version: tuple[int, ...]) -> Problem | None:
    """A controller of another series than the e-Series, which is stopped and asked in other ways."""
    if version[0] >= POLYSCOPE_X:
        return Problem(
            "polyscope_x",
            f"the controller at {host} is a PolyScope X ({version_text(version)}): the ways in which the rig stops an "
            "arm are not proved there",
            "Use an arm with PolyScope 5, or turn the sensors by other means: docs/how-to/other-hardware.md",
        )
    if version[0] < E_SERIES:
        return Problem(
            "cb3_not_supported",
            f"the controller at {host} is one of the CB3 series (software {version_text(version)})",
            "Use an e-Series arm with PolyScope 5, or turn the sensors by other means: docs/how-to/other-hardware.md",
        )
    return None


def identity_problems(arm: ArmSection, report: ArmReport) -> list[Problem]:
    """Whether the arm that answers is the one that was meant, by series, type and lengths: one problem, or none."""
    if series := series_problem(report.host, report.version):
        return [series]
    setup, kinematics = report.setup, report.kinematics
    told = [] if setup is None else [setup.drawing]
    if kinematics is not None and (setup is None or arm.kinematics == "controller"):
        told.append(kinematics)
    if not told and not _called_ur10(report):
        return [
            Problem(
                "arm_not_identified",
                f"the controller at {report.host} does not say which arm it drives (primary interface, port 30001; "
                f"its dashboard: {report.called!r})",
                "Enable the primary interface in the arm's security settings",
            )
        ]
    if setup is not None and setup.robot_type != UR10:
        return [_other(report, f"by its type, {setup.robot_type}")]
    return [_other(report, why) for why in map(_other_length, told) if why is not None][:1]


def _other_length(arm: DenavitHartenberg) -> str | None:
    """What of it has most evidently another length than a UR10e's, if something has."""
    lengths, nominal = lengths_m(arm), lengths_m(NOMINAL)
    worst = int(np.argmax(np.abs(lengths - nominal)))
    if abs(lengths[worst] - nominal[worst]) <= LENGTH_TOLERANCE_M:
        return None
    return f"its {LENGTHS[worst]} is {lengths[worst]:.3f} m, a UR10e's {nominal[worst]:.3f} m"


def _other(report: ArmReport, why: str) -> Problem:
    found = model_found(report) or "another arm"
    return Problem("other_arm", f"the arm at {report.host} is no UR10e: the controller says {found}; {why}", OTHER_ARM)


def _called_ur10(report: ArmReport) -> bool:
    return report.called is not None and report.called.strip().upper() in DASHBOARD_NAMES
