"""The arm's geometry and its tool's frame as a controller tells them."""

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import inf

import numpy as np
import pytest

from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import flange_axes
from rig.motion.turner_state import JointLimits
from rig.turners.ur.arm_driver import look
from rig.turners.ur.arm_report import ArmSetup
from rig.turners.ur.controller.controller_words import ProgramStopped, decode_message
from rig.turners.ur.controller.primary_interface import PORT, ArmDescription, read_description
from support.laboratories.worlds import World
from support.processes.waiting import PATIENCE_S

HOST = "127.0.3.252"
CALIBRATED = DenavitHartenberg(
    (1e-4, -0.7, 0.3, 0.4, -2e-4, 1e-4),
    (1e-4, -0.61, -0.57, 1e-5, 2e-5, 0.0),
    (0.1807, 120.0, -300.0, 180.174, 0.11985, 0.11655),
    (1.5708, 2e-3, -5e-3, 1.5700, -1.5704, 0.0),
)


def package(kind: int, payload: bytes) -> bytes:
    return struct.pack(">iB", 5 + len(payload), kind) + payload


def info(arm: DenavitHartenberg) -> bytes:
    return package(5, struct.pack(">6I24dI", *range(6), *arm.theta_rad, *arm.a_m, *arm.d_m, *arm.alpha_rad, 2))


TURNED = (0.01, 0.0, 0.12, 0.0, 0.5, -0.25)


def cartesian(tcp_offset: tuple[float, ...]) -> bytes:
    return package(4, struct.pack(">12d", 0.4, -0.2, 0.6, 3.1, 0.0, 0.0, *tcp_offset))


UR3E = ArmSetup(
    3,
    DenavitHartenberg(
        (0.0,) * 6,
        (0.0, -0.24355, -0.2132, 0.0, 0.0, 0.0),
        (0.15185, 0.0, 0.0, 0.13105, 0.08535, 0.0921),
        (1.5708, 0.0, 0.0, 1.5708, -1.5708, 0.0),
    ),
    JointLimits((*(-3.1,) * 5, -inf), (*(3.2,) * 5, inf), (3.0, 3.1, 3.2, 6.1, 6.2, 6.3), (40.0,) * 6),
)


def configuration(setup: ArmSetup) -> bytes:
    """Configuration Data, as the maker describes it for PolyScope 5."""
    limits, arm = setup.limits, setup.nominal
    values = [value for pair in zip(limits.least_rad, limits.greatest_rad, strict=True) for value in pair]
    values += [value for pair in zip(limits.speed_rad_s, limits.acceleration_rad_s2, strict=True) for value in pair]
    values += [1.05, 1.4, 0.25, 1.2, 0.5, *arm.a_m, *arm.d_m, *arm.alpha_rad, *arm.theta_rad]
    return package(6, struct.pack(">53d4i", *values, 4, 2, setup.robot_type, 1))


@contextmanager
def saying(*pieces: bytes) -> Iterator[None]:
    """A controller that sends these bytes to whoever connects, and waits until he goes."""

    def serve(listener: socket.socket) -> None:
        client, _ = listener.accept()
        with client:
            for piece in pieces:
                client.sendall(piece)
            client.settimeout(PATIENCE_S)
            client.recv(1)

    with socket.create_server((HOST, PORT)) as listener:
        server = threading.Thread(target=serve, args=(listener,))
        server.start()
        yield
        server.join()


@pytest.mark.parametrize("tool_first", [True, False])
def test_all_are_found_among_other_packages_in_whatever_state_they_come_and_however_they_are_cut(
    tool_first: bool,
) -> None:
    geometry = package(16, package(1, b"q") + configuration(UR3E) + info(CALIBRATED))
    tool = package(16, cartesian(TURNED) + package(0, b""))
    told = tool + geometry if tool_first else geometry + tool
    stream = package(20, b"a message") + package(16, package(0, b"mode")) + told
    with saying(stream[:30], stream[30:80], stream[80:]):
        assert read_description(HOST, 5.0) == ArmDescription(CALIBRATED, TURNED, UR3E)


@pytest.mark.slow
def test_a_controller_that_does_not_tell_is_none() -> None:
    with saying(package(16, package(0, b"mode")), package(16, package(5, b"an older layout"))):
        assert read_description(HOST, 0.3) == ArmDescription()


@pytest.mark.slow
def test_what_one_package_tells_holds_without_the_other() -> None:
    with saying(package(16, info(CALIBRATED) + cartesian((0.0,) * 5 + (float("nan"),)))):
        assert read_description(HOST, 0.3) == ArmDescription(CALIBRATED)
    with saying(package(16, cartesian(TURNED))):
        assert read_description(HOST, 0.3) == ArmDescription(tcp_offset=TURNED)


@pytest.mark.slow
def test_an_arm_that_no_number_describes_is_not_reported() -> None:
    nowhere = replace(UR3E, limits=replace(UR3E.limits, speed_rad_s=(float("nan"),) * 6))
    with saying(package(16, configuration(nowhere) + configuration(UR3E)[:100])):
        assert read_description(HOST, 0.3) == ArmDescription()


def test_what_is_no_primary_interface_is_an_error_of_the_link() -> None:
    with saying(b"Connected: Universal Robots Dashboard Server\n"), pytest.raises(ConnectionError):
        read_description(HOST, 5.0)


@pytest.mark.slow
def test_a_look_tells_the_geometry_of_the_simulated_arm(world: World) -> None:
    told = look(world({}).host)
    assert told.kinematics is not None
    np.testing.assert_allclose(flange_axes(np.zeros(6), told.kinematics), flange_axes(np.zeros(6)), atol=1e-12)
    assert told.tcp_offset == (0.0,) * 6


@pytest.mark.parametrize(
    ("title", "decoded"), [(b"PROGRAM_XXX_STOPPED", ProgramStopped("sweep")), (b"PROGRAM_XXX_STARTED", None)]
)
def test_the_end_of_a_program_is_decoded_with_its_name_and_its_start_is_not(
    title: bytes, decoded: ProgramStopped | None
) -> None:
    head = struct.pack(">QbB", 0, -1, 7) + struct.pack(">iiB", 0, 0, len(title))
    assert decode_message(head + title + b"sweep") == decoded
