"""The simulated laboratory that a station has started, disturbed by a test."""

import json
import socket
import time
from pathlib import Path
from typing import Any

import yaml

WRIST_3, TURNING_RAD_S = 5, 0.2


class Laboratory:
    """The control channel of the station's laboratory."""

    def __init__(self, config: Path) -> None:
        self._address = yaml.safe_load(config.read_text(encoding="utf-8"))["arm"]["host"], 7322

    def __call__(self, do: str, **said: Any) -> dict[str, Any]:
        with socket.create_connection(self._address, 30) as channel:
            channel.sendall(json.dumps({"do": do, **said}).encode() + b"\n")
            reply: dict[str, Any] = json.loads(channel.makefile("rb").readline())
        assert reply["ok"], reply
        return reply

    def disturb(self) -> None:
        """Hold the sensor's input constant for a while in the next turn that begins."""
        self("pace", time_scale=1)
        while abs(self("state")["qd_rad_s"][WRIST_3]) > TURNING_RAD_S:
            time.sleep(0.005)
        while abs(self("state")["qd_rad_s"][WRIST_3]) < TURNING_RAD_S:
            time.sleep(0.005)
        self("hold")
        self("sensor_fault", sensor="gyro", fault="stuck")
        self("advance", duration_s=0.9)
        self("sensor_fault", sensor="gyro", fault=None)
        self("pace", time_scale=12)
        self("run")
