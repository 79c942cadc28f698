"""The world's clock does not run ahead of the programs it serves."""

import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from itertools import pairwise
from pathlib import Path

import pytest

from rig.config.load import load
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Transfer, trapezoid_duration
from rig.turners.turner_registry import sections
from rig.turners.ur.arm_driver import Arm
from rig.world import network, world_process
from rig.world.clock import DIALOGUE_S, TICK_S, WorldClock
from rig.world.wire import FIRST_PATIENCE_S, MAX_PACED_WAIT_S, PATIENCE_GAIN, PATIENCE_S, Wire
from rig.world.world_process import ARM_LAG_S
from support.laboratories.commands import configuration
from support.laboratories.worlds import World, fresh_host
from support.processes.waiting import wait_for
from support.wires.arm_relay import relay
from support.wires.rtde_reader import RtdeReader

PERIOD_S = 0.008  # between packets at 125 Hz
LAG_S = 5.5 * PERIOD_S
FAST = {"world": {"time_scale": 50}}
linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what another program has not read")


class Wall:
    """Wall time that passes when a test says so."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s

    def passes(self, duration_s: float) -> None:
        self.now_s += duration_s


class Client:
    """The bytes a client has not read, the wire to it, and the world that sends a packet every 8 ms of its time."""

    def __init__(self) -> None:
        self.wall, self.unread, self.time_s = Wall(), 0, 0.0
        self.wire = Wire(lambda: self.unread, LAG_S, self.wall)

    def is_sent(self, packets: int) -> None:
        for _ in range(packets):
            self.time_s += PERIOD_S
            self.wire.record_send(self.time_s)
            self.unread += 100

    @property
    def wait_s(self) -> float:
        return self.wire.wait_s(self.time_s + PERIOD_S)

    def takes_all(self, after_s: float) -> None:
        assert self.wait_s > 0.0
        self.wall.passes(after_s)
        self.unread = 0
        assert self.wait_s == 0.0

    def keeps_pace(self, duration_s: float) -> None:
        end_s = self.wall.now_s + duration_s
        while self.wall.now_s < end_s:
            self.is_sent(6)
            self.takes_all(after_s=0.5 * MAX_PACED_WAIT_S)


def test_the_world_waits_for_a_client_that_is_behind() -> None:
    client = Client()
    client.is_sent(5)
    assert client.wait_s == 0.0
    client.is_sent(1)
    assert client.wait_s > 0.0
    client.takes_all(after_s=0.1)
    client.is_sent(5)
    assert client.wait_s == 0.0, "it had caught up"


def test_a_client_that_hangs_gets_what_a_real_controller_sends_while_patience_lasts() -> None:
    """Neither more, so that it catches up, nor less: the world never stands still for it."""
    client = Client()
    client.keeps_pace(2.0 / PATIENCE_GAIN)
    client.is_sent(6)
    began_s, began_world_s = client.wall.now_s, client.time_s
    while (passed_s := client.wall.now_s - began_s) < 1.0:
        if wait_s := client.wait_s:
            client.wall.passes(wait_s)
        else:
            client.is_sent(1)
    assert client.time_s - began_world_s == pytest.approx(passed_s, abs=2 * PERIOD_S), "and it has not caught up"


def test_a_client_that_reads_no_more_slows_the_world_for_nobody() -> None:
    client = Client()
    client.keeps_pace(2.0 * PATIENCE_S / PATIENCE_GAIN)
    client.is_sent(6)
    assert client.wait_s > 0.0
    client.wall.passes(PATIENCE_S * 1.01)
    client.is_sent(100)
    assert client.wait_s == 0.0


def test_a_client_that_is_slow_again_and_again_is_waited_for_once_until_it_keeps_pace_again() -> None:
    client = Client()
    client.is_sent(6)
    client.takes_all(after_s=1.1 * FIRST_PATIENCE_S)
    client.is_sent(6)
    assert client.wait_s == 0.0
    client.wall.passes(0.5 * MAX_PACED_WAIT_S)
    client.unread = 0
    client.is_sent(1)
    client.unread = 0
    assert client.wait_s == 0.0
    client.is_sent(6)
    assert client.wait_s > 0.0, "it took what it was sent at once"


@pytest.mark.slow
def test_a_client_that_does_what_it_can_is_waited_for_however_long() -> None:
    """Half as fast as the world would be, it has never taken all: it stays less than a second behind."""
    client, time_scale, capacity = Client(), 8, 4
    end_s = client.wall.now_s + 60.0
    owed, most = 0.0, 0
    while client.wall.now_s < end_s:
        passes_s = client.wait_s
        if not passes_s:
            client.is_sent(1)
            passes_s = PERIOD_S / time_scale
        client.wall.passes(passes_s)
        owed += capacity * passes_s / PERIOD_S
        taken = 100 * int(owed)
        client.unread, owed = max(100, client.unread - taken), owed % 1.0
        most = max(most, client.unread)
    assert most < 100 * 1.0 / PERIOD_S


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize("reads_per_s", [1, 5])
@pytest.mark.parametrize("time_scale", [2, 8, 50])
def test_a_client_that_reads_now_and_then_changes_the_pace_by_less_than_two_percent(
    reads_per_s: int, time_scale: int
) -> None:
    client = Client()
    began_s = read_s = client.wall.now_s
    while (passed_s := client.wall.now_s - began_s) < 20.0:
        if client.wall.now_s - read_s >= 1.0 / reads_per_s:
            client.unread, read_s = 0, client.wall.now_s
        if wait_s := client.wait_s:
            client.wall.passes(wait_s)
        else:
            client.is_sent(1)
            client.wall.passes(PERIOD_S / time_scale)
    assert client.time_s / passed_s > 0.98 * time_scale


def test_the_clock_goes_no_faster_than_a_real_one_while_a_client_asks() -> None:
    wall = Wall()
    clock = WorldClock(10.0, wall)

    def ticks_in(duration_s: float) -> int:
        before, end_s = clock.tick, wall.now_s + duration_s
        while wall.now_s < end_s:
            wall.passes(max(clock.wait_s(), 1e-5))
            if clock.wait_s() <= 0.0:
                clock.count()
        return clock.tick - before

    assert ticks_in(DIALOGUE_S) == pytest.approx(10 * DIALOGUE_S / TICK_S, rel=0.05)
    clock.dialogue()
    assert ticks_in(DIALOGUE_S * 0.99) == pytest.approx(DIALOGUE_S / TICK_S, abs=1)


def ran_ahead_s(reader: RtdeReader, pause_s: float) -> float:
    """How much further the world went than the wall's clock while nobody read for so long.

    Beyond `MAX_PACED_WAIT_S` the reader slept, and is not waited for: then once more.
    """
    while True:
        before_s, began_s = reader.newest_s(), time.monotonic()
        time.sleep(pause_s)
        after_s = reader.newest_s()
        if (away_s := time.monotonic() - began_s) < MAX_PACED_WAIT_S:
            return after_s - before_s - away_s


@pytest.mark.slow
@linux
@pytest.mark.parametrize("pause_s", [0.003, 0.02])
def test_the_world_does_not_run_ahead_of_a_slow_client(world: World, pause_s: float) -> None:
    reader = RtdeReader(world(FAST).host)
    reader.newest_s()
    for _ in range(6):
        assert ran_ahead_s(reader, pause_s) < ARM_LAG_S + 2 * PERIOD_S
    reader.close()


@pytest.mark.slow
def test_a_client_that_never_reads_again_does_not_stop_the_world_for_others(world: World) -> None:
    running = world(FAST)
    deaf = RtdeReader(running.host)
    reader = RtdeReader(running.host)
    began_s = reader.newest_s()
    wait_for(lambda: reader.newest_s() > began_s + 5.0, "five seconds of the world")
    reader.close()
    deaf.close()


@pytest.mark.slow
def test_a_client_that_comes_back_after_long_is_waited_for_again(world: World) -> None:
    running = world(FAST)
    reader = RtdeReader(running.host)
    before_s = reader.newest_s()
    wait_for(lambda: running.state()["time_s"] > before_s + 5.0, "that the world waits no longer")
    for _ in range(20):
        reader.newest_s()
    assert ran_ahead_s(reader, 0.5 * MAX_PACED_WAIT_S) < ARM_LAG_S + 2 * PERIOD_S
    reader.close()


@pytest.mark.slow
@linux
def test_at_the_pace_of_a_real_controller_nobody_is_waited_for(world: World) -> None:
    """It would be a fifth of that pace where such a reader is waited for, however long one looks."""
    pace = 1.0
    running = world({"world": {"time_scale": pace}})
    reader = RtdeReader(running.host)
    reader.newest_s()

    def keeps_pace() -> bool:
        began_s, began_world_s = time.monotonic(), running.state()["time_s"]
        for _ in range(10):
            time.sleep(0.2)
            reader.newest_s()
        return bool(running.state()["time_s"] - began_world_s > 0.6 * pace * (time.monotonic() - began_s))

    wait_for(keeps_pace, "two seconds at the pace of the wall")
    reader.close()


def turn(arm: Arm) -> Transfer:
    start = arm.latest.q_rad
    return Transfer("test move", start, (*start[:5], start[5] + 4.0), 1.0, 2.0, trapezoid_duration(4.0, 1.0, 2.0))


@pytest.mark.thorough
@pytest.mark.slow
@linux
def test_a_stalled_wire_does_not_end_a_move(world: World) -> None:
    times_s: list[float] = []
    laboratory = world({"world": {"time_scale": 8}})
    with relay(laboratory.host) as wire, Arm(wire.host, lambda state: times_s.append(state.time_s)) as arm:
        arm.take_control(FlangeLoad(0.35, (0.0, 0.0, 0.025)))
        ends = threading.Timer(0.5, wire.stalled.clear)

        def stall() -> None:
            if abs(arm.latest.qd_rad_s[5]) > 0.8 and not ends.is_alive() and not ends.finished.is_set():
                times_s.clear()
                wire.stalled.set()
                ends.start()

        arm.move(turn(arm), stall)
        assert ends.finished.is_set(), "nothing stalled"
        ends.join()
    assert max(after - before for before, after in pairwise(times_s)) < 1.0, "4 s passed in the world meanwhile"


@pytest.mark.slow
@linux
def test_a_driver_that_stalls_for_a_moment_misses_no_state(world: World) -> None:
    others = set(multiprocessing.active_children())
    with Arm(world({"world": {"time_scale": 8}}).host) as arm:
        arm.take_control(FlangeLoad(0.35, (0.0, 0.0, 0.025)))
        (child,) = set(multiprocessing.active_children()) - others
        assert child.pid is not None
        pid, missed = child.pid, arm.missed_states
        stalls = iter([0.3])

        def stall() -> None:
            if abs(arm.latest.qd_rad_s[5]) > 0.8 and (duration_s := next(stalls, None)):
                os.kill(pid, signal.SIGSTOP)
                time.sleep(duration_s)
                os.kill(pid, signal.SIGCONT)

        arm.move(turn(arm), stall)
        assert next(stalls, None) is None, "nothing stalled"
        assert arm.missed_states == missed


class Talker:
    """A device that says one byte a tick."""

    closing = dialogue = False

    def __init__(self) -> None:
        self.said = 0

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        return b""

    def tick(self) -> bytes:
        self.said += 1
        return bytes([self.said])

    def handle_close(self) -> None:
        pass


def test_a_gathering_port_hands_on_in_one_go_what_came_about_while_ticks_were_due(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(network, "GATHER_S", 60.0)
    host = fresh_host()
    ports = network.Network(lambda: None)
    ports.listen(host, 7321, Talker, gathers=True)
    try:
        with socket.create_connection((host, 7321), PATIENCE_S) as client:
            ports.poll(5.0)
            for idle in (False, False, False, True):
                ports.tick()
                assert ports.deliver(idle) == 0.0
            client.settimeout(PATIENCE_S)
            heard = b""
            while len(heard) < 4:
                heard += client.recv(64)
            assert heard == bytes([1, 2, 3, 4])
            ports.tick()
            ports.deliver(idle=False)
            client.setblocking(False)
            with pytest.raises(BlockingIOError):
                client.recv(64)
    finally:
        ports.close()


@pytest.mark.slow
def test_while_nobody_is_connected_it_goes_no_faster_than_a_real_laboratory(tmp_path: Path) -> None:
    """It would take a processor from those who have something to do."""
    world = world_process.World(load(configuration(tmp_path, FAST), turners=sections()))
    began_s = time.monotonic()
    try:
        world.run(lambda: world.end() if time.monotonic() > began_s + 0.05 else None)
    finally:
        world.close()
    assert world.clock.time_s <= time.monotonic() - began_s + TICK_S
