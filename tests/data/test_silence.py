"""Silence is counted so that a busy machine does not look like a process that hangs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest

from firmware_host.computer_load import MAX_LOAD_FACTOR, load_factor
from rig.data.processes.process_silence import Silence
from support.processes.waiting import wait_for

TICK_S = 0.05
SPARED = 10


@contextmanager
def process(code: str) -> Iterator[subprocess.Popen[bytes]]:
    """One that runs `code`, and has begun to."""
    begun = "print(flush=True)\n"
    with subprocess.Popen([sys.executable, "-c", begun + code], stdout=subprocess.PIPE) as running:
        assert running.stdout is not None
        running.stdout.readline()
        try:
            yield running
        finally:
            running.kill()


def ticks_of(silence: Silence, number: int) -> int:
    for _ in range(number):
        time.sleep(TICK_S)
        silence.tick()
    return silence.ticks


@pytest.mark.slow
def test_a_frozen_process_is_silent_in_every_tick() -> None:
    with process("import time; time.sleep(3600)") as frozen:
        frozen.send_signal(signal.SIGSTOP)
        os.waitpid(frozen.pid, os.WUNTRACED)  # until it stands
        assert ticks_of(Silence(frozen.pid, spared=SPARED), 10) == 10


def test_a_sign_of_life_ends_a_silence() -> None:
    silence = Silence(os.getpid(), spared=SPARED)
    for _ in range(5):
        silence.tick()
    silence.heard()
    assert not silence.lasts_over(0)


def test_what_a_process_has_said_and_nobody_has_come_to_is_not_its_silence_for_ever() -> None:
    silence = Silence(os.getpid(), spared=SPARED, thread=0)  # one that waits for no processor
    for _ in range(5 * SPARED):
        silence.tick(unheard=True)
    assert silence.ticks == 0 and not silence.lasts_over(5)
    assert silence.lasts_over(0.9 * 5 / MAX_LOAD_FACTOR), "nobody may be watching any more"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells how many want a processor")
def test_a_crowd_is_noticed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean of the last minute would tell of it in half a minute."""
    monkeypatch.setattr(os, "getloadavg", lambda: (0.0, 0.0, 0.0))
    crowd = 3 * (os.cpu_count() or 1)
    with ExitStack() as busy:
        for _ in range(crowd):
            busy.enter_context(process("while True: pass"))
        wait_for(lambda: load_factor() > 2.0, "the crowd")


@pytest.mark.slow
def test_where_nothing_is_known_of_a_process_every_tick_counts() -> None:
    with process("pass") as ended:
        ended.wait()
        assert ticks_of(Silence(ended.pid, spared=SPARED), 4) == 4


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who waits for a processor")
def test_ticks_in_which_the_process_waited_for_a_processor_do_not_count_for_ever() -> None:
    busy = "while True: pass"
    processor = min(os.sched_getaffinity(0))
    with process(busy) as starved, process(busy) as first, process(busy) as second:
        for each in (starved, first, second):
            os.sched_setaffinity(each.pid, {processor})
        os.setpriority(os.PRIO_PROCESS, starved.pid, 19)
        silence = Silence(starved.pid, spared=SPARED)
        assert ticks_of(silence, 10) <= 4
        assert not silence.lasts_over(9)
        assert silence.lasts_over(10 // SPARED - 1), "however busy the machine, there is an end"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who waits for a processor")
def test_a_main_thread_that_hangs_is_silent_though_another_thread_waits_for_a_processor() -> None:
    """Like a driver whose client spins in a thread of its own: that says nothing for the thread that is waited for."""
    spinning = "import threading, time, zlib\ndef spin():\n while True: zlib.crc32(bytes(10**6))\n"
    hanging = spinning + "threading.Thread(target=spin, daemon=True).start()\ntime.sleep(3600)"
    processor = min(os.sched_getaffinity(0))
    with process(hanging) as hung, process("while True: pass") as first, process("while True: pass") as second:
        for each in (hung, first, second):
            os.sched_setaffinity(each.pid, {processor})
        assert ticks_of(Silence(hung.pid, spared=SPARED, thread=hung.pid), 10) >= 8
