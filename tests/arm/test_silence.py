"""Silence is counted so that a busy machine does not look like a process that hangs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from rig.arm.silence import SPARED, Silence

TICK_S = 0.05


@contextmanager
def process(code: str) -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen([sys.executable, "-c", code]) as running:
        try:
            yield running
        finally:
            running.kill()


def ticks_of(silence: Silence, number: int) -> int:
    for _ in range(number):
        time.sleep(TICK_S)
        silence.tick()
    return silence.ticks


def test_a_frozen_process_is_silent_in_every_tick() -> None:
    with process("import time; time.sleep(60)") as frozen:
        frozen.send_signal(signal.SIGSTOP)
        assert ticks_of(Silence(frozen.pid), 10) == 10


def test_a_sign_of_life_ends_a_silence() -> None:
    silence = Silence(os.getpid())
    for _ in range(5):
        silence.tick()
    silence.heard()
    assert not silence.lasts_over(0)


def test_where_nothing_is_known_of_a_process_every_tick_counts() -> None:
    with process("pass") as ended:
        ended.wait()
        assert ticks_of(Silence(ended.pid), 4) == 4


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who waits for a processor")
def test_ticks_in_which_the_process_waited_for_a_processor_do_not_count_for_ever() -> None:
    busy = "while True: pass"
    processor = min(os.sched_getaffinity(0))
    with process(busy) as starved, process(busy) as first, process(busy) as second:
        for each in (starved, first, second):
            os.sched_setaffinity(each.pid, {processor})
        os.setpriority(os.PRIO_PROCESS, starved.pid, 19)
        silence = Silence(starved.pid)
        assert ticks_of(silence, 10) <= 4
        assert not silence.lasts_over(9)
        assert silence.lasts_over(10 // SPARED - 1), "however busy the machine, there is an end"
