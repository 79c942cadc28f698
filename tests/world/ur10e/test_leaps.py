"""Ticks that the world makes in one go while the arm stands: the bytes on every wire are those of ticks one by one."""

import json
import selectors
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import yaml

from rig.config.load import Loaded, parse
from rig.plans.procedure_registry import load_procedures, sections
from rig.world import world_process
from rig.world.ur10e.interfaces.rtde import build_package
from rig.world.world_process import World
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

OUTPUTS = "timestamp,actual_q,actual_qd,actual_TCP_pose,runtime_state,speed_scaling,output_int_register_0"
INPUTS = "input_int_register_0,input_int_register_1," + ",".join(f"input_double_register_{i}" for i in range(8))
AWAY = (0.0, -1.5, 1.5, -1.5, -1.4, 0.3)
MOVE = f"def away():\n  movej({list(AWAY)}, a=8, v=3)\n  sleep(0.1)\nend\n"


def register_input(command: int, *doubles: float) -> bytes:
    """What ur_rtde writes for its program: a command, not asynchronous, and its numbers."""
    numbers = [*doubles, *[0.0] * (8 - len(doubles))]
    return build_package("U", struct.pack(">B2i8d", 1, command, 0, *numbers))


class Laboratory:
    """A held world in a thread, and everybody who is connected to it."""

    def __init__(self, loaded: Loaded, ports: dict[str, int]) -> None:
        self.world = World(loaded)
        self.turns = self.senses = 0
        self._count()
        self.world.clock.hold()
        self._thread = threading.Thread(target=self.world.run, daemon=True)
        self._thread.start()
        host = loaded.config.arm.host
        self._selector = selectors.DefaultSelector()
        self.control = socket.create_connection((host, 7322), PATIENCE_S)
        self._replies = b""
        self.wires = {name: socket.create_connection((host, port), PATIENCE_S) for name, port in ports.items()}
        self.heard = dict.fromkeys(ports, b"")
        for name, wire in [*self.wires.items(), ("control", self.control)]:
            wire.setblocking(False)
            self._selector.register(wire, selectors.EVENT_READ, name)

    def _count(self) -> None:
        laboratory = self.world.laboratory
        turn, sense = laboratory.turn, laboratory.sense

        def counted_turn() -> None:
            self.turns += 1
            turn()

        def counted_sense() -> None:
            self.senses += 1
            sense()

        laboratory.turn, laboratory.sense = counted_turn, counted_sense  # pyrefly: ignore[method-assign]  # a stand-in

    def ask(self, **request: Any) -> None:
        """Ask the world itself, reading all wires until it has answered."""
        self.control.send(json.dumps(request).encode() + b"\n")
        while b"\n" not in self._replies:
            for key, _ in self._selector.select(20.0):
                data = key.fileobj.recv(1 << 16)  # pyrefly: ignore[missing-attribute]  # a socket
                assert data, f"{key.data} hung up"
                if key.data == "control":
                    self._replies += data
                else:
                    self.heard[key.data] += data
        assert json.loads(self._replies)["ok"], self._replies
        self._replies = b""

    def passes(self, duration_s: float) -> None:
        """So much time; what was said before is heard before, and all that is sent meanwhile arrives."""
        self.ask(do="state")
        self.ask(do="advance", duration_s=duration_s)
        for _ in range(3):
            self.ask(do="state")

    def close(self) -> None:
        self.world.end()
        self._thread.join(PATIENCE_S)
        for wire in (*self.wires.values(), self.control):
            wire.close()
        self._selector.close()
        self.world.close()


@contextmanager
def laboratory(loaded: Loaded, ports: dict[str, int]) -> Iterator[Laboratory]:
    running = Laboratory(loaded, ports)
    try:
        yield running
    finally:
        running.close()


def loaded_from(name: str, host: str) -> tuple[Loaded, dict[str, int]]:
    """A configuration of configs/ with its imperfections, and the ports of its wires."""
    document = yaml.safe_load((parsed := parse_file(name)).text)
    ports = {"states": 30004, "primary": 30001, "dashboard": 29999, "script": 30002}
    document = merge(document, {"arm": {"host": host}, "world": {"time_scale": 1000}})
    if parsed.config.board is not None:
        document["board"]["port"] = f"socket://{host}:7321"
        ports["board"] = 7321
    for sensor, section in parsed.config.sensors.items():
        if section.serial is not None:
            document["sensors"][sensor]["serial"]["port"] = f"socket://{host}:7331"
            ports["kvh"] = 7331
    return parse(yaml.safe_dump(document), sections=sections(load_procedures())), ports


def parse_file(name: str) -> Loaded:
    from rig.config.load import load

    return load(CONFIGS / name, sections=sections(load_procedures()))


def session(loaded: Loaded, ports: dict[str, int], dwell_s: float) -> tuple[dict[str, bytes], float]:
    """Programs that move and wait, a slider, a stop, and dwells between; every wire's bytes, and ticks per look."""
    with laboratory(loaded, ports) as run:
        states = run.wires["states"]
        run.passes(0.1)
        if "kvh" in ports:
            run.wires["kvh"].send(b"=CONFIG,1\r\n=DR,250\r\n=OUTPUTFMT,B\r\n=CONFIG,0\r\n")
        states.send(
            build_package("V", struct.pack(">H", 2)) + build_package("O", struct.pack(">d", 125.0) + OUTPUTS.encode())
        )
        states.send(build_package("I", INPUTS.encode()) + build_package("S", b""))
        run.passes(dwell_s)
        run.wires["script"].send(MOVE.encode())
        run.passes(dwell_s + 0.7)
        run.wires["script"].send(b"def rtde_control():\n  x\nend\n")
        run.passes(dwell_s)
        states.send(register_input(1, *(angle + 0.2 for angle in AWAY), 2.0, 6.0))
        run.passes(dwell_s + 0.4)
        states.send(register_input(0))
        run.passes(dwell_s)
        run.wires["dashboard"].send(b"stop\n")
        run.passes(dwell_s)
        return run.heard, run.turns / run.senses


def test_every_wire_carries_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    host = fresh_host()
    found = []
    for leap in (1, world_process.MAX_LEAP_TICKS):
        monkeypatch.setattr(world_process, "MAX_LEAP_TICKS", leap)
        found.append(session(*loaded_from("own_port/kvh1775_earth.yaml", host), dwell_s=0.6))
    (one_by_one, looks), (leaping, fewer_looks) = found
    assert looks == 1.0 and fewer_looks > 1.5, "it leaps"
    for wire, said in one_by_one.items():
        assert said == leaping[wire], wire
    assert len(one_by_one["states"]) > 10_000
