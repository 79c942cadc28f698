"""The processes from which `support.processes.warm` forks others: `python nursery.py ENVIRONMENT`.

One has imported everything; the other, in an environment with the variables in the JSON argument, only what readers of
files need. The line on stdout gives by module the address for orders. They end with their standard input.
"""

import atexit
import gc
import inspect
import json
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Collection
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

# The modules that a run, its laboratory and readers of their result import sooner or later.
IMPORTED = (
    *(
        "rig.cli",
        "rig.commands.measure.run",
        "rig.commands.measure.carry_out",
        "rig.commands.configured",
        "rig.commands.offline.solve",
    ),
    *("rig.procedure", "rig.runner.phases", "rig.report.document", "rig.history.store", "rig.world.world_process"),
    *("rig.turners.ur.ur_kind", "rig.turners.servo.servo_kind", "rig.turners.hand.hand_kind"),
    *("rig.turners.ur.arm_driver", "rig.turners.ur.arm_preflight", "rig.turners.servo.servo_driver"),
    *("rig.commands.measure.check_devices", "rig.commands.devices.board_commands", "rig.commands.station.station"),
    *("rig.analysis.judging", "rig.report.entry_sources", "rig.report.certificate.certificate_page"),
    *("procedures.six_observation", "procedures.imu", "procedures.verify", "procedures.by_hand"),
    *("firmware_host.emulator.parts.lsm9ds1", "firmware_host.emulator.parts.adis16465"),
    *("h5py", "jinja2", "scipy.interpolate", "scipy.ndimage", "serial.urlhandler.protocol_socket", "encodings.idna"),
)
# A reader of foreign files is allowed little memory, and imports little: only what reads them.
READS = (
    *("rig.data.processes.reading_process", "rig.data.recording.run_reading", "rig.data.recording.extract"),
    *("rig.observation.formats.csv_table", "rig.observation.formats.table_layout"),
    *("rig.observation.formats.bag_samples", "rig.observation.formats.ulog_samples"),
    *("h5py", "numpy.typing", "rosbags.rosbag2", "rosbags.typesys", "pyulog.core"),
)
DEMO = Path(__file__).parents[3] / "configs" / "demo.yaml"
LABORATORY, READER = "rig.world", "rig.data.processes.reading_child"

Order = dict[str, Any]


class Forked(subprocess.Popen[Any]):
    """A Popen whose process is no child of this one, so that its exit status comes through a socket.

    `address`: where its order is sent; `command`: the words after `python -m`, or with `safe_path` after `python -P
    -m`.
    """

    def __init__(self, address: str, command: list[str], *, safe_path: bool, **options: Any) -> None:
        self._address, self._safe_path = address, safe_path
        super().__init__(command, **options)

    def _execute_child(self, *given: Any) -> None:
        of_popen = super()._execute_child  # pyrefly: ignore[missing-attribute]  # of CPython itself
        named = inspect.signature(of_popen).bind(*given).arguments
        module, *words = named["args"]
        order = {
            "module": module,
            "words": words,
            "environment": dict(os.environ if named["env"] is None else named["env"]),
            "folder": str(named["cwd"] or Path.cwd()),
            "safe_path": self._safe_path,
            "new_session": named["start_new_session"],
            "ignored": [number for number in signal.valid_signals() if signal.getsignal(number) == signal.SIG_IGN],
        }
        ends = ("p2cread", "c2pwrite", "errwrite")
        inherited_or_given = [number if named[end] == -1 else named[end] for number, end in enumerate(ends)]
        self.pid, self._status = _born(self._address, order, inherited_or_given)
        self._child_created = True
        self._close_pipe_fds(  # pyrefly: ignore[missing-attribute]  # of CPython itself
            *(named[end] for end in ("p2cread", "p2cwrite", "c2pread", "c2pwrite", "errread", "errwrite"))
        )

    def _internal_poll(self, _deadstate: int | None = None) -> int | None:
        if self.returncode is None and self._waitpid_lock.acquire(blocking=False):  # pyrefly: ignore[missing-attribute]  # of CPython itself
            try:
                pid, status = self._try_wait(os.WNOHANG)
                if pid == self.pid:
                    self._handle_exitstatus(status)  # pyrefly: ignore[missing-attribute]  # of CPython itself
            finally:
                self._waitpid_lock.release()  # pyrefly: ignore[missing-attribute]  # of CPython itself
        return self.returncode

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        try:
            status = _number(self._status, socket.MSG_DONTWAIT if wait_flags & os.WNOHANG else 0)
        except BlockingIOError:
            return 0, 0
        self._status.close()
        return self.pid, status


def fork_modules(modules: Collection[str], address: Callable[[str], str]) -> None:
    """Fork every `python -P -m MODULE …` of these modules that this process starts by Popen.

    A laboratory is forked only into a session of its own, as a run does, so that no signal for the run reaches it.
    """

    class Named(Forked):
        def __init__(self, args: list[str], **options: Any) -> None:
            super().__init__(address(args[3]), args[3:], safe_path=True, **options)

    def new(kind: type[subprocess.Popen[Any]], args: Any, *_: Any, **options: Any) -> subprocess.Popen[Any]:
        named = isinstance(args, list) and args[:3] == [sys.executable, "-P", "-m"] and args[3] in modules
        is_one = named and (args[3] != LABORATORY or options.get("start_new_session"))
        return object.__new__(Named if is_one else kind)

    subprocess.Popen.__new__ = new  # pyrefly: ignore[bad-assignment, method-assign]  # of CPython itself


def _born(address: str, order: Order, streams: list[int]) -> tuple[int, socket.socket]:
    """Fork a process; return its id, and the socket that gets its status at its end (of `os.waitpid`, 4 bytes)."""
    kept, child_end = socket.socketpair()
    with child_end, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as orders:
        orders.connect(bytes.fromhex(address))
        socket.send_fds(orders, [json.dumps(order).encode()], [*streams, child_end.fileno()])
    return _number(kept), kept


def _number(channel: socket.socket, flags: int = 0) -> int:
    number = channel.recv(4, flags)
    assert number, "the process that all are forked from has ended"
    return int.from_bytes(number, "little")


def listening() -> socket.socket:
    """Return a listening socket for orders, at an address that the system chooses."""
    orders = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    orders.bind("")
    orders.listen()
    return orders


def address_of(orders: socket.socket) -> str:
    """Return a socket's address as written in JSON."""
    return bytes(orders.getsockname()).hex()


def serve_orders(orders: socket.socket) -> Order | None:
    """Fork until standard input ends; return the order in each forked process, and None at the end."""
    with selectors.DefaultSelector() as selector:
        selector.register(orders, selectors.EVENT_READ)
        selector.register(sys.stdin, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fileobj is sys.stdin:
                    return None
                if key.fileobj is not orders:
                    _tell_status(*key.data)
                    selector.unregister(key.fileobj)
                    os.close(key.fd)
                    continue
                with orders.accept()[0] as once:
                    text, descriptors, _, _ = socket.recv_fds(once, 1 << 20, 4)
                if not text:  # who wanted to give one has ended
                    continue
                *streams, status = descriptors
                if not (process := os.fork()):
                    selector.close()
                    order: Order = json.loads(text)
                    _become(order, streams, status)
                    return order
                for stream in streams:
                    os.close(stream)
                selector.register(os.pidfd_open(process), selectors.EVENT_READ, (process, status))


def _tell_status(process: int, channel: int) -> None:
    """Send its exit status if the client still waits for it."""
    _, status = os.waitpid(process, 0)
    with suppress(BrokenPipeError):
        os.write(channel, status.to_bytes(4, "little"))
    os.close(channel)


def _become(order: Order, streams: list[int], channel: int) -> None:
    """Take the environment, folder, session, signals and streams of a process that the system has just started."""
    if order["new_session"]:
        os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in order["ignored"]:
        signal.signal(number, signal.SIG_IGN)
    os.environ.clear()
    os.environ.update(order["environment"])
    os.chdir(order["folder"])
    sys.path[:1] = [] if order["safe_path"] else [order["folder"]]
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    for name, stream, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        of_old = getattr(sys, name)
        buffering = 1 if name == "stderr" else -1
        new = open(stream, mode, buffering, of_old.encoding, of_old.errors, closefd=False)  # noqa: SIM115
        setattr(sys, name, new)
        setattr(sys, f"__{name}__", new)
    os.write(channel, os.getpid().to_bytes(4, "little"))
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))


def _serve() -> None:
    """Start both processes, with everything and for readers only; their forked children continue from here."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for those that were forked
    sys.path[0] = str(Path.cwd())  # as of `python -m`
    everything, reading = listening(), listening()
    addresses = {"rig": address_of(everything), LABORATORY: address_of(everything), READER: address_of(reading)}
    print(json.dumps(addresses), flush=True)
    reads = not os.fork()
    (everything if reads else reading).close()  # so that who asks one that has ended is refused
    if reads:
        os.environ.update(json.loads(sys.argv[1]))
    for module in READS if reads else IMPORTED:
        import_module(module)
    if not reads:
        import_module("firmware_host.emulator.hooks").address_of("block")  # translated here, for every laboratory
        import_module("rig.config.load").load(DEMO)  # builds the models, which takes longer than to use them
    gc.collect()
    gc.freeze()  # objects that are never scanned are shared, not copied
    if order := serve_orders(reading if reads else everything):
        fork_modules((LABORATORY, READER), addresses.__getitem__)
        sys.argv = ["", *order["words"]]
        _run_and_end(order["module"])


def _run_and_end(module: str) -> None:
    """Run `python -m MODULE` and end as Python does, without clearing its memory.

    Most of that is shared with the other processes, and would be copied first, which takes a fifth of a second. What
    ends otherwise than by an exit status, or cannot write its last lines, is ended by Python.
    """
    status: object = None
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        status = ended.code
    if status is None or isinstance(status, int):
        threading._shutdown()  # pyrefly: ignore[missing-attribute]  # of CPython itself
        atexit._run_exitfuncs()
        with suppress(OSError, ValueError, AttributeError):
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(int(status or 0) & 0xFF)
    sys.exit(status)  # pyrefly: ignore[bad-argument-type]  # as it was given


if __name__ == "__main__":
    _serve()
