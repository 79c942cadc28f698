"""The process that `support.warm` has its processes forked from: `python nursery.py SOCKET`, the number of a socket."""

import gc
import json
import os
import runpy
import selectors
import signal
import socket
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

# What a run, its laboratory and what reads their result import sooner or later.
IMPORTED = (
    *("rig.cli", "rig.commands.run", "rig.commands.carry_out", "rig.commands.configured", "rig.commands.solve"),
    *("rig.procedure", "rig.runner.phases", "rig.report.document", "rig.history.store", "rig.world.process"),
    *("rig.turners.ur.kind", "rig.turners.servo.kind", "rig.turners.hand.kind"),
    *("h5py", "jinja2", "scipy.interpolate", "scipy.ndimage"),
)


def ordered(orders: socket.socket) -> dict[str, Any] | None:
    """Fork until there are no orders any more: in a process that was forked what it shall do, None in the end."""
    with selectors.DefaultSelector() as selector:
        selector.register(orders, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fileobj is not orders:
                    _tell_status(*key.data)
                    selector.unregister(key.fileobj)
                    os.close(key.fd)
                    continue
                text, given, _, _ = socket.recv_fds(orders, 1 << 20, 4)
                if not text:
                    return None
                *streams, told = given
                if not (process := os.fork()):
                    selector.close()
                    orders.detach()
                    order: dict[str, Any] = json.loads(text)
                    _become(order, streams, told)
                    return order
                for stream in streams:
                    os.close(stream)
                selector.register(os.pidfd_open(process), selectors.EVENT_READ, (process, told))


def _tell_status(process: int, told: int) -> None:
    """How it ended, where somebody still wants to know."""
    _, status = os.waitpid(process, 0)
    with suppress(BrokenPipeError):
        os.write(told, status.to_bytes(4, "little"))
    os.close(told)


def _become(order: dict[str, Any], streams: list[int], told: int) -> None:
    """The environment, folder, session, signals and streams of a process that the system has just started."""
    if order["new_session"]:
        os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in order["ignored"]:
        signal.signal(number, signal.SIG_IGN)
    os.environ.clear()
    os.environ.update(order["environment"])
    os.chdir(order["folder"])
    sys.path[0] = order["folder"]
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    for name, stream, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        of_old = getattr(sys, name)
        buffering = 1 if name == "stderr" else -1
        new = open(stream, mode, buffering, of_old.encoding, of_old.errors, closefd=False)  # noqa: SIM115
        setattr(sys, name, new)
        setattr(sys, f"__{name}__", new)
    os.write(told, os.getpid().to_bytes(4, "little"))
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for those that were forked
    sys.path[0] = str(Path.cwd())  # as of `python -m`
    for module in IMPORTED:
        import_module(module)
    gc.collect()
    gc.freeze()  # what is never looked through is shared, not copied
    if order := ordered(socket.socket(fileno=int(sys.argv[1]))):
        sys.argv = ["", *order["words"]]
        runpy.run_module(order["module"], run_name="__main__", alter_sys=True)
