"""What a controller is asked while nothing moves: whether the rig can stop its arm, and what it says of itself.

One with PolyScope 5 is asked at its dashboard. A PolyScope X has none: RTDE, the primary interface and the Robot API
tell what they can.
"""

from contextlib import closing
from dataclasses import replace

from rig.errors import Problem, Refused
from rig.motion.state import ArmState, RuntimeState
from rig.turners.ur.condition import MAKERS_SIMULATOR
from rig.turners.ur.controller.dashboard import Dashboard
from rig.turners.ur.controller.primary import Account, read_account
from rig.turners.ur.controller.primary_stop import PrimaryStop
from rig.turners.ur.controller.registers import free_half
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.identity import is_polyscope_x, model_found, series_problem
from rig.turners.ur.messages import Connected
from rig.turners.ur.report import ArmReport

LOOK_S = 1.0  # for a port that may be closed
ANSWER_S = 5.0  # one that is open has so long to answer while nothing moves
NOT_TOLD = "not told"


def stop_problem(host: str, version: tuple[int, ...]) -> Problem | None:
    """Why the rig could not stop an arm there without its client; None where it can."""
    way = PrimaryStop if is_polyscope_x(version) else Dashboard
    try:
        way(host, LOOK_S).close()
    except OSError as error:
        return series_problem(host, version) or _closed(way, host, error)
    return None


def no_states(host: str, error: OSError) -> Problem:
    """What is there where no states come: no arm, or one whose other ports answer."""
    for way in (Dashboard, PrimaryStop):
        try:
            way(host, LOOK_S).close()
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


def in_local_control(host: str, version: tuple[int, ...]) -> bool:
    """Whether a controller with a dashboard says so; another one tells it in the trial of its stop, or not."""
    if is_polyscope_x(version) or host in MAKERS_SIMULATOR:
        return False
    try:
        with Dashboard(host, ANSWER_S) as dashboard:
            return dashboard.in_remote_control() is False
    except OSError:
        return False


def reported(host: str, connected: Connected, state: ArmState, robot_api_port: int) -> ArmReport:
    """What the controller says of itself and of its arm, which stands in that state. Raises `Refused` by name."""
    account = _account(host)
    report = ArmReport(
        host=host,
        version=connected.version,
        polyscope=account.software or ".".join(map(str, connected.version)),
        serial_number=NOT_TOLD,
        remote_control=None,
        program_running=state.runtime_state != RuntimeState.STOPPED,
        state=state,
        kinematics=account.kinematics,
        tcp_offset=account.tcp_offset,
        setup=account.setup,
        registers_free=_registers_free(host, connected.version),
    )
    if is_polyscope_x(connected.version):
        complete = _completed_by_robot_api(report, RobotApi(host, robot_api_port, LOOK_S))
    else:
        try:
            with closing(Dashboard(host, ANSWER_S)) as dashboard:
                complete = _completed_by_dashboard(report, dashboard)
        except OSError as error:
            raise Refused.of(_closed(Dashboard, host, error)) from error
    return replace(complete, model=model_found(complete))


def _completed_by_dashboard(report: ArmReport, dashboard: Dashboard) -> ArmReport:
    return replace(
        report,
        polyscope=dashboard.polyscope(),
        serial_number=dashboard.serial_number(),
        remote_control=dashboard.in_remote_control(),
        program_running=dashboard.program_running(),
        called=dashboard.robot_model(),
    )


def _completed_by_robot_api(report: ArmReport, api: RobotApi) -> ArmReport:
    return replace(report, serial_number=api.serial_number() or NOT_TOLD, remote_control=api.in_remote_control())


def _account(host: str) -> Account:
    """What the controller tells; nothing without its primary interface."""
    try:
        return read_account(host, ANSWER_S)
    except OSError:
        return Account()


def _registers_free(host: str, version: tuple[int, ...]) -> bool | None:
    """Whether the client would find a half of the registers free; None where the controller does not tell."""
    try:
        return free_half(host, version, LOOK_S) is not None
    except OSError:
        return None


def _closed(way: type[Dashboard] | type[PrimaryStop], host: str, error: OSError) -> Problem:
    """A port without which the rig does not move an arm, because it stops it there."""
    if way is Dashboard:
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
