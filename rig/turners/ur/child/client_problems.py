"""The problems of the client and its connections, as the supervised process reports them."""

from rig.errors import Problem
from rig.turners.ur.condition import local_control
from rig.turners.ur.controller.free_registers import registers_in_use
from rig.turners.ur.controller.state_stream import ImpossibleState, NotSupported, StatePacket
from rig.turners.ur.controller_answers import no_states
from rig.turners.ur.identity import series_problem, version_text

LINK_REMEDY = "Look at the arm and its network cable, then start again"


def control_failure(host: str, version: tuple[int, ...], reason: str) -> Problem:
    """Return the problem that explains why the client's constructor failed, according to its message."""
    if "remote control" in reason:
        return local_control(host)
    if "already in use" in reason:  # the register was taken after the check
        return registers_in_use(host, version)
    return Problem(
        "control_not_taken",
        f"the arm at {host} did not start the control script ({reason})",
        "Clear any stop on the pendant, switch it to remote control, close other programs, then start again",
    )


def move_failure(what: str) -> Problem:
    """Return the problem of a move that was not begun."""
    return Problem("move_refused", what, "Read the pendant's log and check the configured speed and acceleration")


def payload_failure(reported_kg: float, wanted_kg: float) -> Problem:
    """Return the problem of a payload that the arm's states do not show, for an unknown reason."""
    return Problem(
        "payload_not_set",
        f"the controller uses a payload of {reported_kg:g} kg instead of {wanted_kg:g} kg",
        "Read the pendant's log, and correct the payload in the arm's installation",
    )


def link_lost(what: str) -> Problem:
    """Return the problem of a connection that delivers no more states."""
    return Problem("arm_link_lost", what, LINK_REMEDY)


def payload_changed(ours: StatePacket, theirs: StatePacket) -> Problem:
    """Return the problem of a payload that another program has set after this one."""

    def show(packet: StatePacket) -> str:
        centre = ", ".join(f"{1e3 * coordinate_m:.0f}" for coordinate_m in packet.payload_centre_m)
        return f"{packet.payload_kg:g} kg at ({centre}) mm"

    return Problem(
        "payload_changed",
        f"the controller uses a payload of {show(theirs)} instead of {show(ours)}: another program has set it",
        "Find what sets it (a URCap of a gripper, another client, the pendant) and end it, then start again",
    )


def connection_failure(host: str, error: OSError) -> Problem:
    """Return the problem that explains why no states come from the controller at `host`."""
    if isinstance(error, ImpossibleState):
        return error.problem
    if isinstance(error, NotSupported):
        return series_problem(host, error.version) or Problem(
            "controller_too_old",
            f"the controller at {host} does not know {error.what}; its software is {version_text(error.version)}",
            "Update it: the rig was tested with PolyScope 5.14",
        )
    return no_states(host, error)
