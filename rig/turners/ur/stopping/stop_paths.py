"""The paths of a stop without the client: over plain TCP, at ports of the controller."""

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

    After the order to stop, `acknowledged` is whether the controller has confirmed the order, and `refusal` contains
    its words if it has refused. If the connection `reports_programs`, both may also be set later, by a report on
    programs. Methods raise `OSError` if the controller does not answer in time.
    """

    @property
    def acknowledged(self) -> bool: ...
    @property
    def refusal(self) -> str | None: ...
    @property
    def reports_programs(self) -> bool: ...
    def stop_program(self) -> None: ...
    def program_running(self) -> bool: ...
    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class StopPath:
    """A path of a stop, by its name; `open` makes the connection with a time-out in s for each answer."""

    name: str
    open: Callable[[float], StopConnection]


def stop_paths(host: str, version: tuple[int, ...], robot_api_port: int) -> tuple[StopPath, ...]:
    """Return the stop paths of the controller `host` with software `version`; the first one is indispensable."""
    primary = StopPath(PrimaryStop.name, partial(PrimaryStop, host))
    if not is_polyscope_x(version):
        return StopPath(Dashboard.name, partial(Dashboard, host)), primary
    if version < robot_api.MIN_VERSION:
        return (primary,)
    return primary, StopPath(RobotApiStop.name, partial(RobotApiStop, host, robot_api_port))
