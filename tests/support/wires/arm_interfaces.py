"""The maker's three interfaces to a simulated arm, connected for a block."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol, TypeVar

from rtde_control import RTDEControlInterface
from rtde_io import RTDEIOInterface
from rtde_receive import RTDEReceiveInterface

from support.laboratories.worlds import WorldHandle

HOME = [0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0]
ENCODER_RAD = 1.5e-4  # six times the encoders' noise


class Client(Protocol):
    """What the maker's three interfaces have in common."""

    def disconnect(self) -> None: ...


C = TypeVar("C", bound=Client)


@contextmanager
def disconnecting(interface: C) -> Iterator[C]:
    try:
        yield interface
    finally:
        interface.disconnect()


def control_of(world: WorldHandle) -> AbstractContextManager[RTDEControlInterface]:
    return disconnecting(RTDEControlInterface(world.host))


def reports_of(world: WorldHandle, rate_hz: float = 500.0) -> AbstractContextManager[RTDEReceiveInterface]:
    return disconnecting(RTDEReceiveInterface(world.host, rate_hz))


def outputs_of(world: WorldHandle) -> AbstractContextManager[RTDEIOInterface]:
    return disconnecting(RTDEIOInterface(world.host))
