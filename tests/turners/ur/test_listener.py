"""The process that a simulated controller is, found by the address it listens at."""

import socket
import subprocess
import sys
from ipaddress import IPv4Address

import pytest

from rig.turners.ur.controller.listener import find_listener
from rig.turners.ur.controller.rtde_packages import PORT
from support.laboratories.worlds import World, fresh_host

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells")


@pytest.mark.slow
def test_a_simulated_controller_is_found(world: World) -> None:
    laboratory = world()
    assert find_listener(IPv4Address(laboratory.host), PORT) == laboratory.process.pid


@pytest.mark.slow
def test_one_that_listens_at_every_address_is_found() -> None:
    serving = "import socket; s = socket.create_server(('', 0)); print(s.getsockname()[1], flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", serving], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert find_listener(IPv4Address("127.0.0.1"), int(process.stdout.readline())) == process.pid


def test_where_nobody_listens_there_is_nobody() -> None:
    host = fresh_host()
    with socket.create_server((host, 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection((host, port)):
            assert find_listener(IPv4Address(host), port + 1) is None
    assert find_listener(IPv4Address(host), port) is None
