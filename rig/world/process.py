"""The world's process: one thread, one loop, the laboratory in the middle and sockets around it."""

import json
import selectors
import signal
import sys
import time
from collections.abc import Callable

from rig.config.load import Loaded
from rig.errors import Refused
from rig.world import dashboard, rtde, script
from rig.world.clock import Clock
from rig.world.control import ControlSession
from rig.world.laboratory import Laboratory
from rig.world.network import Network
from rig.world.robot import Robot

IDLE_POLL_S = 0.2


class World:
    """Laboratory, clock and sockets."""

    def __init__(self, loaded: Loaded) -> None:
        if loaded.world is None:
            raise Refused(
                "no_world",
                "the configuration has no world: section, so there is nothing to simulate",
                "Name a file with a world: section, for example configs/demo.yaml",
            )
        self.laboratory = Laboratory(loaded.config, loaded.world)
        self.network = Network()
        self._silent_until_s = 0.0
        self._ended = False
        self._host, self._control_port = loaded.config.arm.host, loaded.world.control_port
        self._board_url = loaded.config.board.port
        try:
            robot, host = self.laboratory.robot, self._host
            new_sessions: dict[
                int, Callable[[Robot], rtde.RtdeSession | dashboard.DashboardSession | script.ScriptSession]
            ]
            new_sessions = {
                dashboard.PORT: dashboard.DashboardSession,
                script.PRIMARY_PORT: script.ScriptSession,
                script.SECONDARY_PORT: script.ScriptSession,
                script.REALTIME_PORT: script.ScriptSession,
                rtde.PORT: rtde.RtdeSession,
            }
            self.arm_listeners = [
                self.network.listen(host, port, lambda new=new: new(robot))  # type: ignore[misc]
                for port, new in new_sessions.items()
            ]
            self.network.listen(host, self._control_port, lambda: ControlSession(self))
        except Refused:
            self.network.close()
            raise
        self.clock = Clock(loaded.world.time_scale, time.monotonic)

    def silence_arm(self, duration_s: float) -> None:
        """The controller neither sends nor reads for so long (wall time: a client's patience is wall time too)."""
        self._silent_until_s = time.monotonic() + duration_s
        for listener in self.arm_listeners:
            listener.set_silent(True)

    def end(self) -> None:
        self._ended = True

    def describe(self) -> str:
        """The line that says where everything listens."""
        control = f"{self._host}:{self._control_port}"
        return json.dumps({"ready": True, "arm": self._host, "board": self._board_url, "pty": None, "control": control})

    def run(self) -> None:
        """Serve until `end`."""
        while not self._ended:
            wait_s = self.clock.wait_s()
            self.network.poll(min(wait_s, IDLE_POLL_S))
            if self._silent_until_s and time.monotonic() >= self._silent_until_s:
                self._silent_until_s = 0.0
                for listener in self.arm_listeners:
                    listener.set_silent(False)
            if not self._ended and self.clock.wait_s() <= 0.0:
                self.laboratory.step()
                self.clock.count()
                self.network.tick()

    def close(self) -> None:
        self.network.close()


def serve(loaded: Loaded, until_eof: bool) -> None:
    """Run the world until end of input (`until_eof`) or Ctrl-C. Raises `Refused` when a port cannot be had."""
    world = World(loaded)
    try:
        signal.signal(signal.SIGTERM, lambda *_: world.end())
        if until_eof:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            world.network.selector.register(sys.stdin.buffer, selectors.EVENT_READ, lambda _: _read_input(world))
        print(world.describe(), flush=True)
        world.run()
    except KeyboardInterrupt:
        pass
    finally:
        world.close()


def _read_input(world: World) -> None:
    if not sys.stdin.buffer.raw.read(4096):  # type: ignore[attr-defined]
        world.end()
