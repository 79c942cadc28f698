"""What is connected before its run holds nothing of that run afterwards."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from weakref import ref

from rig.motion.turner_state import State
from rig.runner.early_connection import EarlyConnection
from rig.turners.turner import Turner
from rig.turners.turner_kind import OnState


class Acquisition:
    """Stands for all that a run reads."""

    states = 0

    def on_state(self, state: State) -> None:
        self.states += 1


@contextmanager
def connect(on_state: OnState, log: Path) -> Iterator[Turner]:
    """A turner that tells one state, and goes on to know whom it told."""
    turner = SimpleNamespace(check=lambda: None, missed_states=0, told=on_state)
    yield cast(Turner, turner)
    on_state(cast(State, None))


def test_what_a_run_has_read_is_let_go_with_it(tmp_path: Path) -> None:
    ahead = EarlyConnection(connect, tmp_path / "arm.log")
    gc.disable()
    try:
        for _ in range(3):
            ahead.begin()
            acquisition = Acquisition()
            with ahead.connect_turner(acquisition.on_state, tmp_path / "arm.log"):
                pass
            assert acquisition.states == 1, "the run hears the turner to its end"
            left = ref(acquisition)
            del acquisition
            assert left() is None
    finally:
        gc.enable()
