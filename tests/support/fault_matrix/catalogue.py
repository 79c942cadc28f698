"""The faults: how each is caused and repaired, and how a run with it may end."""

import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from random import Random
from types import MappingProxyType
from typing import Any

from support.fault_matrix.bench import Bench
from support.fault_matrix.wires import Damage, flipping, losing, repeating
from support.processes.waiting import PATIENCE_S

Act = Callable[[Bench, Random], object]

STOPPED, INTERRUPTED, KILLED = 3, 130, -signal.SIGKILL
LINK = frozenset({"arm_link_lost", "arm_driver_died", "arm_driver_hung"})
BOARD = frozenset({"board_link_lost", "board_error", "lost_samples", "no_samples"})
RECONNECTED = frozenset({"program_stopped"})  # a client that finds a lost arm again restarts its program
CONTROL_S = 1.5  # the control mode is asked twice a second
LINK_S, DRIVER_S, SUPERVISOR_S, BOARD_S = 0.8, 0.5, 2.0, 2.0  # silences that are faults, docs/architecture.md
HELLO_S, CLOSED_S = 0.5, 0.3  # a board that has restarted says so, docs/protocol.md; a port that closes is read


def nothing(bench: Bench, random: Random) -> None:
    """Do nothing."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault, with the permitted ends of a run.

    - `names`, `statuses`: the permitted early ends.
    - `may_pass`: whether the run may reach its verdict; `late_may_pass`: the same if all data for a calibration were
      recorded before the fault.
    - `known_s`: the real time after which the rig can detect it (None: only in the recorded data, and until then the
      arm continues).
    - `lasts_s`: the time until its repair, also during the run (None: after the run).
    - `kept_s`: the last part of the received data may be missing from the file, because it was in memory.
    """

    area: str
    name: str
    bring: Act
    mend: Act = nothing
    names: frozenset[str] = frozenset()
    statuses: frozenset[int] = frozenset({STOPPED})
    may_pass: bool = False
    late_may_pass: bool = False
    known_s: float | None = 0.0
    lasts_s: float | None = None
    kept_s: float = 0.0
    environment: Mapping[str, str] = field(default_factory=lambda: MappingProxyType(dict[str, str]()))


# -- the controller, by the world's control channel ------------------------------------------------------------------
def _order(do: str, **values: object) -> Act:
    return lambda bench, random: bench.world.control({"do": do, **values})


def _unlock(bench: Bench, random: Random) -> None:
    bench.until(lambda state: _dashboard(bench, "unlock protective stop").startswith("Protective"), 60, running=False)


def _switch_on(bench: Bench, random: Random) -> None:
    bench.world.control({"do": "release"})
    bench.until(lambda state: state["robot_mode"] == "POWER_OFF", 60, running=False)  # half a second after the stop
    for order in ("power_on", "brake_release"):
        bench.world.control({"do": order})
    bench.until(lambda state: state["robot_mode"] == "RUNNING", 60, running=False)


def _dashboard(bench: Bench, line: str) -> str:
    with (
        socket.create_connection((bench.world.host, 29999), PATIENCE_S) as connection,
        connection.makefile("rw") as talk,
    ):
        talk.readline()
        talk.write(f"{line}\n")
        talk.flush()
        return talk.readline()


def _controller(name: str, do: str, end: str, mend: Act = nothing, **values: object) -> Fault:
    # What is let go of at once afterwards may be seen as the program that it stopped.
    return Fault("controller", name, _order(do, **values), mend, frozenset({end, "program_stopped", "arm_paused"}))


def _nudge(bench: Bench, random: Random) -> None:
    with socket.create_connection((bench.world.host, 30002), PATIENCE_S) as connection:
        connection.sendall(b"def nudge():\n movej([0.1, -1.57, 1.57, -1.57, -1.57, 0], a=1.4, v=1.0)\nend\n")


def _another_rig(bench: Bench, random: Random) -> None:
    folder = bench.config.parent / "second"
    folder.mkdir()
    config = shutil.copy(bench.config, folder)
    second = subprocess.Popen(
        [sys.executable, "-m", "rig", "run", str(config), "--out", str(folder / "run"), "--yes"],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    bench.companions.append(second)


# -- the wires -------------------------------------------------------------------------------------------------------
def _stall(name: str) -> Act:
    return lambda bench, random: bench.wire[name].stalled.set()


def _half_close(name: str) -> Act:
    return lambda bench, random: bench.wire[name].half_close()


def _hang_up(*names: str, refuse: bool = False) -> Act:
    def act(bench: Bench, random: Random) -> None:
        for name in names:
            bench.wire[name].refusing = refuse
            bench.wire[name].hang_up()

    return act


def _delay(seconds: float, name: str) -> Act:
    return lambda bench, random: setattr(bench.wire[name], "delay_s", seconds)


def _spoil(damage: Callable[[float, int], Damage], fraction: float, name: str) -> Act:
    def act(bench: Bench, random: Random) -> None:
        bench.wire[name].damage = damage(fraction, random.getrandbits(32))

    return act


def _heal(bench: Bench, random: Random) -> None:
    for wire in bench.wire.values():
        wire.heal()


ARM = ("rtde", "dashboard", "primary", "secondary", "script")


def _heal_and_stop(bench: Bench, random: Random) -> None:
    _heal(bench, random)
    bench.world.control({"do": "stop_program"})


def _net(
    name: str,
    bring: Act,
    names: frozenset[str] = LINK,
    *,
    mend: Act = _heal,
    known_s: float | None = LINK_S,
    **more: Any,
) -> Fault:
    return Fault("network", name, bring, mend, names, known_s=known_s, **more)


# -- processes -------------------------------------------------------------------------------------------------------
def _kill(number: signal.Signals, whose: str) -> Act:
    def act(bench: Bench, random: Random) -> None:
        pid = {"rig": bench.pid, "driver": bench.driver_pid, "world": bench.world.process.pid}[whose]
        if pid is not None:
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    return act


def _kill_any(bench: Bench, random: Random) -> None:
    """Kill a random process of the rig."""
    _kill(signal.SIGKILL, random.choice(["rig", "driver"]))(bench, random)


def _signal(number: signal.Signals) -> Fault:
    statuses = frozenset({INTERRUPTED})
    return Fault("signal", number.name, lambda bench, random: bench.send(number), statuses=statuses)


# -- disk and clocks ---------------------------------------------------------------------------------------------------
def _fill_disk(bench: Bench, random: Random) -> None:
    """Prevent all files of the rig from growing by a limit on file size, like a full disk but without another disk.

    The effect comes when a file must grow: HDF5 allocates space for some seconds of samples at a time.
    """
    size = (bench.out / "run.h5").stat().st_size
    resource.prlimit(bench.pid, resource.RLIMIT_FSIZE, (size, size))


def _make_immutable(on: bool) -> Act:
    def act(bench: Bench, random: Random) -> None:
        if bench.out.exists():
            subprocess.run(["chattr", "+i" if on else "-i", str(bench.out)], check=on, capture_output=True)

    return act


def _shift_clock(seconds: int) -> Act:
    return lambda bench, random: (bench.config.parent.parent / "clock_shift").write_text(f"{seconds}")


def _sensor(name: str, fault: str, names: frozenset[str], *, known_s: float | None = None, **more: Any) -> Fault:
    return Fault(
        "sensor", name, _order("sensor_fault", sensor="gyro", fault=fault),
        _order("sensor_fault", sensor="gyro", fault=None), names, known_s=known_s, **more,
    )  # fmt: skip


SPOILT = frozenset({1, STOPPED})
KILL = frozenset({KILLED})

CATALOGUE: tuple[Fault, ...] = (
    _controller("protective stop", "protective_stop", "protective_stop", _unlock),
    _controller("emergency stop", "emergency_stop", "emergency_stop", _switch_on),
    _controller("safeguard stop", "safeguard_stop", "safeguard_stop", _order("release")),
    _controller("power off", "power_off", "arm_not_running", _switch_on),
    _controller("program stopped on the pendant", "stop_program", "program_stopped"),
    _controller("program paused on the pendant", "pause", "arm_paused"),
    _controller("slider to 50 %", "speed_slider", "speed_slider", _order("speed_slider", fraction=1), fraction=0.5),
    _controller("slider to 0", "speed_slider", "speed_slider", _order("speed_slider", fraction=1), fraction=0),
    Fault("controller", "local control", _order("remote_control", on=False), _order("remote_control", on=True),
          frozenset({"not_in_remote_control", "switched_to_local_control"}), known_s=CONTROL_S, late_may_pass=True),
    Fault("controller", "registers claimed by a fieldbus", _order("register_in_use"), _order("register_free"),
          frozenset({"registers_in_use"}), may_pass=True),
    Fault("controller", "somebody else's program", _nudge, names=frozenset({"program_stopped"})),
    Fault("controller", "second rig on the same arm and board", _another_rig, may_pass=True, known_s=None),
    # A crowded computer may not notice it while it lasts; the client has then missed the end of the movement.
    Fault("controller", "silent for 3 s", _order("silence_arm", duration_s=3),
          names=LINK | RECONNECTED | {"arm_slower_than_planned"}, known_s=LINK_S),
    Fault("controller", "closes its connections", _order("close_arm"), names=LINK, known_s=LINK_S),
    # No process is left to stop it: the movement ends at its target, and the program waits on the pendant.
    _net("controller gone: all ports refused", _hang_up(*ARM, refuse=True), known_s=None, mend=_heal_and_stop),
    _net("RTDE stalls", _stall("rtde")),
    _net("RTDE half-closed", _half_close("rtde")),
    _net("RTDE reset", _hang_up("rtde")),
    # What makes sense is believed, damaged or not: any name will do, as long as nothing false passes.
    _net("RTDE loses 1 % of its bytes", _spoil(losing, 0.01, "rtde"), frozenset(), known_s=None),
    _net("RTDE has wrong bits in 0.1 % of its bytes", _spoil(flipping, 0.001, "rtde"), frozenset(), may_pass=True,
         known_s=None),
    _net("RTDE comes 0.3 s late", _delay(0.3, "rtde"), may_pass=True, known_s=None, names=LINK),
    _net("dashboard stalls", _stall("dashboard"), may_pass=True, known_s=None),
    _net("dashboard refused", _hang_up("dashboard", refuse=True), may_pass=True, known_s=None),
    _net("primary and script ports reset", _hang_up("primary", "secondary", "script"), may_pass=True, known_s=None),
    Fault("board", "reset", _order("reset_board"), names=frozenset({"board_error"}), known_s=HELLO_S),
    Fault("board", "unplugged", _order("unplug_board"), _order("plug_in_board"), BOARD, known_s=CLOSED_S),
    Fault("board", "silent line", _order("silence_board", on=True), _order("silence_board", on=False), BOARD,
          known_s=BOARD_S),
    Fault("board", "other baud rate", _order("host_baud", baud=115200), _order("host_baud", baud=None),
          BOARD, known_s=BOARD_S),
    Fault("board", "wire stalls", _stall("board"), _heal, BOARD, known_s=BOARD_S),
    Fault("board", "wire half-closed", _half_close("board"), _heal, BOARD, known_s=CLOSED_S),
    Fault("board", "wire reset", _hang_up("board"), _heal, BOARD, known_s=CLOSED_S),
    Fault("board", "wire loses 0.1 % of its bytes", _spoil(losing, 0.001, "board"), _heal, BOARD, known_s=None,
          statuses=SPOILT, may_pass=True),
    Fault("board", "wire has wrong bits in 0.1 % of its bytes", _spoil(flipping, 0.001, "board"), _heal, BOARD,
          known_s=None, statuses=SPOILT, may_pass=True),
    Fault("board", "wire delivers 5 % twice", _spoil(repeating, 0.05, "board"), _heal, BOARD, known_s=None,
          may_pass=True),
    Fault("board", "wire comes 0.3 s late", _delay(0.3, "board"), _heal, BOARD, known_s=None, may_pass=True),
    _sensor("silent: no data-ready", "silent", frozenset({"sensor_silent", "lost_samples", *BOARD}), known_s=2.0),
    _sensor("not there", "absent", frozenset({"sensor_silent", "sensor_absent", "sensor_fault", *BOARD,
                                              "checksum_failed", "stuck_sensor", "saturation", "stuck_axis"}),
            statuses=SPOILT),
    _sensor("bad contact", "damaged", frozenset({"sensor_fault", "checksum_failed", "sensor_silent", "not_settled"}),
            statuses=SPOILT, may_pass=True),
    _sensor("stuck", "stuck", frozenset({"stuck_axis", "stuck_sensor", "no_motion", "wrong_axis", "wrong_sign",
                                         "wrong_unit", "zero_reading", "time_base_not_found",
                                         "attitude_untrustworthy", "no_rates"}),
            statuses=SPOILT, late_may_pass=True),
    _sensor("saturated", "saturated", frozenset({"saturation", "time_base_not_found"}), statuses=SPOILT),
    Fault("process", "kill -9: the rig or its driver", _kill_any, names=LINK, statuses=frozenset({STOPPED, KILLED}),
          kept_s=1.0),
    Fault("process", "kill -9: the rig", _kill(signal.SIGKILL, "rig"), statuses=KILL, kept_s=1.0),
    Fault("process", "kill -9: the driver", _kill(signal.SIGKILL, "driver"), names=LINK),
    Fault("process", "the rig frozen for 6 s", _kill(signal.SIGSTOP, "rig"), _kill(signal.SIGCONT, "rig"),
          LINK | BOARD, known_s=SUPERVISOR_S, lasts_s=6.0),
    Fault("process", "the driver frozen", _kill(signal.SIGSTOP, "driver"), names=LINK, known_s=DRIVER_S),
    Fault("process", "the laboratory frozen for 3 s", _kill(signal.SIGSTOP, "world"), _kill(signal.SIGCONT, "world"),
          LINK | BOARD | RECONNECTED, known_s=LINK_S, lasts_s=3.0, may_pass=True),
    Fault("disk", "full", _fill_disk, names=frozenset({"recording_failed", "system"}), known_s=None, kept_s=1.0),
    Fault("disk", "folder read-only", _make_immutable(True), _make_immutable(False), frozenset({"system"}),
          known_s=None, may_pass=True),
    Fault("clock", "one hour forward", _shift_clock(3600), may_pass=True, known_s=None,
          environment={"CLOCK_SHIFT": "yes"}),
    Fault("clock", "one hour back", _shift_clock(-3600), may_pass=True, known_s=None,
          environment={"CLOCK_SHIFT": "yes"}),
    *(_signal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)),
    *(_signal(number) for number in (signal.SIGUSR1, signal.SIGALRM)),
)  # fmt: skip

BY_NAME: Mapping[str, Fault] = {f"{fault.area}: {fault.name}": fault for fault in CATALOGUE}
