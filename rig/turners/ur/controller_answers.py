"""Queries of the controller while nothing moves: whether the rig could stop the arm, and what the arm reports.

A controller with PolyScope 5 answers through its dashboard. A PolyScope X has no dashboard, so the answers come from
RTDE, the primary interface and the Robot API, as far as these provide them.
"""

from contextlib import closing
from dataclasses import replace

from rig.errors import Problem, Refused
from rig.motion.turner_state import ArmState, RuntimeState
from rig.turners.ur.arm_report import ArmReport
from rig.turners.ur.child_messages import Connected
from rig.turners.ur.condition import SIMULATOR_HOSTS
from rig.turners.ur.controller.dashboard import Dashboard
from rig.turners.ur.controller.free_registers import find_free_half
from rig.turners.ur.controller.primary_interface import ArmDescription, read_description
from rig.turners.ur.controller.primary_stop import PrimaryStop
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.identity import identify_model, is_polyscope_x, series_problem

CLOSED_PORT_TIMEOUT_S = 1.0  # of a port that may be closed
OPEN_PORT_TIMEOUT_S = 5.0  # while nothing moves
NOT_REPORTED = "not reported"


def stop_problem(host: str, version: tuple[int, ...]) -> Problem | None:
    """Return why the rig could not stop the arm at this controller if the client failed; None if it could."""
    interface = PrimaryStop if is_polyscope_x(version) else Dashboard
    try:
        interface(host, CLOSED_PORT_TIMEOUT_S).close()
    except OSError as error:
        too_old = series_problem(host, version) if is_polyscope_x(version) else None  # a CB3 has a dashboard too
        return too_old or _describe_closed_port(interface, host, error)
    return None


def no_states(host: str, error: OSError) -> Problem:
    """Return the problem of a host that sends no states: either no arm answers, or only other ports of the arm do."""
    for interface in (Dashboard, PrimaryStop):
        try:
            interface(host, CLOSED_PORT_TIMEOUT_S).close()
        except OSError:
            continue
        return Problem(
            "no_arm_states",
            f"the controller at {host} accepts connections but sends no states ({error})",
            "Check that the arm has finished booting and that no firewall blocks port 30004",
        )
    return Problem(
        "no_arm",
        f"no arm answers at {host} ({error})",
        "Check arm.host in the configuration, the network cable, and that the arm is switched on",
    )


def reports_local_control(host: str, version: tuple[int, ...]) -> bool:
    """Return whether the dashboard reports local control; False without a dashboard.

    Without a dashboard the trial of the stop shows local control.
    """
    if is_polyscope_x(version) or host in SIMULATOR_HOSTS:
        return False
    try:
        with Dashboard(host, OPEN_PORT_TIMEOUT_S) as dashboard:
            return dashboard.is_in_remote_control() is False
    except OSError:
        return False


def read_report(host: str, connected: Connected, state: ArmState, robot_api_port: int) -> ArmReport:
    """Return what the controller reports about itself and its arm, whose present state is `state`.

    Raise Refused for the problem of `_describe_closed_port` if the dashboard does not answer.
    """
    description = _read_description(host)
    report = ArmReport(
        host=host,
        version=connected.version,
        polyscope=description.software or ".".join(map(str, connected.version)),
        serial_number=NOT_REPORTED,
        remote_control=None,
        program_running=state.runtime_state != RuntimeState.STOPPED,
        state=state,
        kinematics=description.kinematics,
        tcp_offset=description.tcp_offset,
        setup=description.setup,
        registers_free=_has_free_registers(host, connected.version),
    )
    if is_polyscope_x(connected.version):
        complete = _add_robot_api_answers(report, RobotApi(host, robot_api_port, CLOSED_PORT_TIMEOUT_S))
    else:
        try:
            with closing(Dashboard(host, OPEN_PORT_TIMEOUT_S)) as dashboard:
                complete = _add_dashboard_answers(report, dashboard)
        except OSError as error:
            raise Refused.from_problem(_describe_closed_port(Dashboard, host, error)) from error
    return replace(complete, model=identify_model(complete))


def _add_dashboard_answers(report: ArmReport, dashboard: Dashboard) -> ArmReport:
    return replace(
        report,
        polyscope=dashboard.polyscope(),
        serial_number=dashboard.serial_number(),
        remote_control=dashboard.is_in_remote_control(),
        program_running=dashboard.program_running(),
        called=dashboard.robot_model(),
    )


def _add_robot_api_answers(report: ArmReport, api: RobotApi) -> ArmReport:
    return replace(report, serial_number=api.serial_number() or NOT_REPORTED, remote_control=api.is_in_remote_control())


def _read_description(host: str) -> ArmDescription:
    """Return the controller's description of its arm, empty if the primary interface is closed."""
    try:
        return read_description(host, OPEN_PORT_TIMEOUT_S)
    except OSError:
        return ArmDescription()


def _has_free_registers(host: str, version: tuple[int, ...]) -> bool | None:
    """Return whether a half of the registers is free for the client; None if the controller does not answer."""
    try:
        return find_free_half(host, version, CLOSED_PORT_TIMEOUT_S) is not None
    except OSError:
        return None


def _describe_closed_port(interface: type[Dashboard] | type[PrimaryStop], host: str, error: OSError) -> Problem:
    """Return the problem of a closed port that the rig needs to stop an arm."""
    if interface is Dashboard:
        return Problem(
            "no_dashboard",
            f"the dashboard server at {host} does not answer ({error})",
            "Enable the dashboard server in the arm's security settings",
        )
    return Problem(
        "no_primary_interface",
        f"the primary interface at {host} does not answer ({error}), and the rig stops a PolyScope X there",
        "Enable the primary client interface in the arm's security settings",
    )
