"""A simulated laboratory in a process of its own, on a loopback address of its own."""

import itertools
import json
import os
import socket
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

from support.laboratories.ideal import ideal_document
from support.paths import DEMO
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

END_S = 30.0  # that a world is given to end, before it is made to

# What `world` makes of demo.yaml with this: a calibration with a reference, and its verification, in few seconds.
QUICK_EXPERIMENT: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {
        "gyro": {"rate_hz": 119},
        "reference": {"part": "adis16465", "serial_number": "ADIS16465-001", "role": "reference", "rate_hz": 100},
    },
    "procedure": {"verify": True, "speed_deg_s": 160, "acceleration_deg_s2": 700, "rest_s": 0.5},
    "limits": {"scale_std": 1, "bias_std_rad_s": 1, "verification_rms_rad_s": 1, "verification_mean_rad_s": 1},
    "world": {"time_scale": 12, "sensors": {"reference": {"scale": [1.0, 1.0, 1.0], "bias_rad_s": [0.0, 0.0, 0.0]}}},
}

_addresses = itertools.count()


def fresh_host() -> str:
    """Return a loopback address that nothing else uses, as a robot's ports are fixed."""
    number, pid = next(_addresses), os.getpid()
    return f"127.{20 + number % 200}.{pid // 250 % 250 + 1}.{pid % 250 + 1}"


def merge(base: Any, changes: Any) -> Any:
    """Return `base` with the nested `changes` applied."""
    if isinstance(base, Mapping) and isinstance(changes, Mapping):
        return {**base, **{key: merge(base.get(key), value) for key, value in changes.items()}}
    return changes


def hardware(config: Path, folder: Path) -> Path:
    """Write `folder`/hardware.yaml: a configuration without its world, as for real devices."""
    document = yaml.safe_load(config.read_text(encoding="utf-8"))
    del document["world"]
    path = folder / "hardware.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def late_path(config_path: Path) -> Path:
    """Return the file in which a world notes the causes of late steps."""
    return config_path.with_suffix(".late.txt")


class WorldHandle:
    """A running world. `control` asks its control channel, so that tests can make the laboratory misbehave."""

    def __init__(self, config_path: Path, process: subprocess.Popen[bytes], ready: Mapping[str, Any]) -> None:
        self.config_path = config_path
        self.process = process
        self.host: str = ready["arm"]
        self.board_port: str = ready["board"]
        self.pty: str | None = ready["pty"]
        host, port = str(ready["control"]).rsplit(":", 1)
        self._socket = socket.create_connection((host, int(port)), PATIENCE_S)
        self._replies = self._socket.makefile("rb")

    def control(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Send one request (`{"do": NAME, …}`) and return the reply; a refusal fails the test."""
        self._socket.sendall(json.dumps(dict(request)).encode() + b"\n")
        reply: dict[str, Any] = json.loads(self._replies.readline())
        assert reply["ok"], f"{request}: {reply}"
        return reply

    def state(self) -> dict[str, Any]:
        return self.control({"do": "state"})

    def stop(self) -> None:
        """End the world, by closing its standard input, and by force if need be."""
        self._replies.close()
        self._socket.close()
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.close()
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()


World = Callable[..., WorldHandle]


@contextmanager
def worlds(folder: Path) -> Iterator[World]:
    """Yield a starter of worlds whose configurations lie in `folder`; every world ends with the block."""
    running: list[WorldHandle] = []

    def start(changes: Mapping[str, Any] | None = None) -> WorldHandle:
        """Start a world with an ideal arm, changed by `changes`, at an address of its own."""
        host = fresh_host()
        address = {"arm": {"host": host}, "board": {"port": f"socket://{host}:7321"}}
        document = merge(merge(ideal_document(DEMO), address), changes or {})
        config_path = folder / f"world-{len(running)}.yaml"
        config_path.write_text(yaml.safe_dump(document, sort_keys=False, allow_unicode=True), encoding="utf-8")
        process = start_module(
            *(config_path, "--until-eof", "--late", late_path(config_path)),
            module="rig.world",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert line, f"the world of {config_path} did not start, exit status {process.wait(PATIENCE_S)}"
            description = json.loads(line)
            assert description["ready"], description
            handle = WorldHandle(config_path, process, description)
        except BaseException:
            process.kill()
            process.communicate()
            raise
        running.append(handle)
        return handle

    try:
        yield start
    finally:
        for handle in running:
            handle.stop()


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Yield a starter of worlds: `world({"world": {"time_scale": 1}})` is demo.yaml, changed, on a fresh address."""
    with worlds(tmp_path) as start:
        yield start
