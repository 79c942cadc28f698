"""The states that a simulated arm's controller sends over RTDE, in process: one per tick, as a logger stores them."""

import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.load import load
from rig.world.arm_motion_source import ArmMotionSource
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.interfaces.rtde import OutputRecipe
from rig.world.world_section import read_world_section
from support.paths import DEMO

Array = NDArray[np.float64]
COLUMNS: Mapping[str, int] = {
    "timestamp": 1, "target_q": 6, "target_qd": 6, "target_qdd": 6, "actual_q": 6, "actual_qd": 6, "speed_scaling": 1,
}  # fmt: skip
PATIENCE_TICKS = 20_000


class LoggedArm:
    """An arm in a laboratory of its own, and a client that logs all its states at 500 Hz."""

    def __init__(self, overrides: Sequence[str] = ()) -> None:
        loaded = load(DEMO, list(overrides))
        self.source = ArmMotionSource(loaded.config, read_world_section(loaded))
        self.robot = self.source.robot
        self._output = OutputRecipe(list(COLUMNS), 500.0, 1)
        self._rows: list[tuple[Any, ...]] = []

    def run(self, script: str) -> None:
        """Let the controller play a script that a client sends."""
        PrimarySession(self.robot).receive(script.encode() + b"\n")

    def log(self, ticks: int) -> None:
        """Log `ticks` states."""
        layout = f">{sum(COLUMNS.values())}d"
        for _ in range(ticks):
            self.source.step()
            self._rows.append(struct.unpack(layout, self._output.pack(self.robot)[4:]))

    def log_move(self, script: str, after_ticks: int = 100) -> None:
        """Log a move from its order until `after_ticks` after its end."""
        self.run(script)
        self.log(20)
        for _ in range(PATIENCE_TICKS):
            self.log(1)
            if not self.robot.robot_status_bits & 2:
                break
        self.log(after_ticks)

    def take(self) -> dict[str, Array]:
        """Return the log since the last call: columns (n,) or (n, 6)."""
        rows = np.array(self._rows)
        self._rows = []
        ends = np.cumsum(list(COLUMNS.values()))
        return {
            name: rows[:, end - size] if size == 1 else rows[:, end - size : end]
            for (name, size), end in zip(COLUMNS.items(), ends, strict=True)
        }
