"""A controller's messages after a bad way, read by the rig; a hundred thousand: benchmarks/wire/damaged_frames.py."""

import socket
import threading
from contextlib import suppress

import pytest

from rig.turners.ur.controller.dashboard import DASHBOARD_PORT, Dashboard
from support.laboratories.worlds import fresh_host
from support.wires.damaged_messages import carry_to_rig

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["RTDE", "dashboard", "primary"])
def test_a_damaged_message_is_read_or_an_error_of_the_link(name: str) -> None:
    ends = carry_to_rig(name, 100, seed=1)
    assert sum(ends.values()) == 100
    assert 10 < ends["ConnectionError"] < 100, ends


@pytest.mark.parametrize("said", [b"Connected: again\n", b"Program running: fal"], ids=["greetings", "no end of line"])
def test_a_dashboard_that_talks_without_end_is_given_up_in_time(said: bytes) -> None:
    host = fresh_host()
    with socket.create_server((host, DASHBOARD_PORT)) as listener:

        def talk() -> None:
            client, _ = listener.accept()
            with client, suppress(OSError):
                while True:
                    client.sendall(said)

        talker = threading.Thread(target=talk)
        talker.start()
        with (
            Dashboard(host, timeout_s=0.1) as dashboard,
            pytest.raises(OSError, match=r"in time|timed out|not a dashboard"),
        ):
            dashboard.program_running()
        talker.join()
