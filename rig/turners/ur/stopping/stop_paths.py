"""How the program on a controller is ended without the client: over plain TCP, at ports of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from rig.turners.ur.controller import robot_api
from rig.turners.ur.controller.dashboard import Dashboard
from rig.turners.ur.controller.primary_stop import PrimaryStop
from rig.turners.ur.controller.robot_api import RobotApiStop
from rig.turners.ur.identity import is_polyscope_x


class StopConnection(Protocol):
    """A connection to the controller by which its program is ended.

    Once the order is given, `acknowledged` says whether the controller has said that it took it, and `refusal` its
    words where it has said no; that may come later, with what it says of its programs (where it `tells_of_programs`).
    Its methods raise `OSError` when the controller does not answer in time.
    """

    @property
    def acknowledged(self) -> bool: ...
    @property
    def refusal(self) -> str | None: ...
    @property
    def tells_of_programs(self) -> bool: ...
    def stop_program(self) -> None: ...
    def program_running(self) -> bool: ...
    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class StopPath:
    """Where a stop goes, by its name; `open` makes the connection, which has so many seconds for each answer."""

    name: str
    open: Callable[[float], StopConnection]


def stop_paths(host: str, version: tuple[int, ...], robot_api_port: int) -> tuple[StopPath, ...]:
    """The paths at the controller `host` with that software, the one no arm is moved without first."""
    primary = StopPath(PrimaryStop.name, partial(PrimaryStop, host))
    if not is_polyscope_x(version):
        return StopPath(Dashboard.name, partial(Dashboard, host)), primary
    if version < robot_api.SINCE:
        return (primary,)
    return primary, StopPath(RobotApiStop.name, partial(RobotApiStop, host, robot_api_port))
