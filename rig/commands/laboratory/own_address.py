"""A simulated laboratory has a loopback address to itself: where another has the one of the file, it moves."""

import os
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from rig.commands.laboratory.claims import claimed_arm, claimed_laboratory
from rig.config.load import Loaded, load
from rig.config.models import RigConfig, SensorsConfig
from rig.errors import Refused
from rig.station.plain_text import say

ARM_PORT = 30004  # one of those at which every controller listens, whoever has started it
CANDIDATES = 250


@contextmanager
def own_address(config: SensorsConfig, laboratory: str | None) -> Iterator[list[str]]:
    """What to override of a configuration so that its laboratory is nobody else's, for the length of the `with` block.

    `laboratory` is the file as used where it has a simulated one, else None. Nothing where its address is free, or it
    is real. Nor where none of many is: whoever needs it then says so.
    """
    if laboratory is None or not isinstance(config, RigConfig):
        yield []
        return
    host = config.turner.simulated_at or _board_host(config)
    with ExitStack() as held:
        own = next((each for each in (host, *_others()) if _take(each, held)), host)
        if own != host:
            say(f"simulated laboratory: another one uses {host}, so this one uses {own}", file=sys.stderr)
        yield [] if own == host else [*_turner_moved(config, laboratory, own), *_moved(config, own)]


@contextmanager
def loaded_here(path: Path, overrides: Sequence[str]) -> Iterator[Loaded]:
    """A configuration, its laboratory at an address of its own, without its procedure. Raises Refused as `load`."""
    loaded = load(path, overrides, sections=None)
    with own_address(loaded.config, loaded.laboratory) as moved:
        yield load(path, [*overrides, *moved], sections=None) if moved else loaded


def _others() -> Iterator[str]:
    """Loopback addresses, other ones for every process first."""
    process = os.getpid()
    for number in range(CANDIDATES):
        yield f"127.0.{1 + process // CANDIDATES % CANDIDATES}.{2 + (process + number) % CANDIDATES}"


def _take(host: str, held: ExitStack) -> bool:
    """Take an address if it is free: no rig works there, no laboratory is being set up there, nothing listens."""
    with ExitStack() as claims, socket.socket() as probe:
        try:
            claims.enter_context(claimed_laboratory(host))
            with claimed_arm(host):
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((host, ARM_PORT))
                probe.listen()
        except (Refused, OSError):
            return False
        held.push(claims.pop_all())
    return True


def _board_host(config: SensorsConfig) -> str:
    """Where a simulated board answers that no arm turns."""
    return "" if config.board is None else urlsplit(config.board.port).hostname or ""


def _turner_moved(config: RigConfig, text: str, host: str) -> Iterator[str]:
    """What turns, under the key of the file that says it, at another host."""
    import yaml

    section = "turner" if "turner" in yaml.safe_load(text) else "arm"
    for key, value in config.turner.moved_to(host).items():
        yield f"{section}.{key}={value}"


def _moved(config: SensorsConfig, host: str) -> Iterator[str]:
    """The ports of the configuration, at another host."""
    for key, port in config.ports.items():
        yield f"{key}=socket://{host}:{urlsplit(port).port}"
