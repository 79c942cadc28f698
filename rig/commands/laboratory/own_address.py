"""A loopback address for each simulated laboratory: that in its file or, if that is in use, another one."""

import os
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from rig.commands.laboratory.claims import claim_arm, claim_laboratory
from rig.config.load import Loaded, load
from rig.config.models import RigConfig, SensorsConfig
from rig.errors import Refused
from rig.station.plain_text import say

ARM_PORT = 30004  # a port at which every controller listens, whoever started it
MAX_CANDIDATES = 250


@contextmanager
def find_own_address(config: SensorsConfig, laboratory: str | None) -> Iterator[list[str]]:
    """Yield the overrides that give a configuration's laboratory an address of its own during the block.

    `laboratory` is the configuration's text if its laboratory is simulated, else None. There are no overrides if the
    configured address is free, if the laboratory is real, or if no address is free. In the last case a later claim
    fails.
    """
    if laboratory is None or not isinstance(config, RigConfig):
        yield []
        return
    hosts = (urlsplit(port).hostname for port in config.ports.values())  # the board's first, for one without an arm
    host = config.turner.simulated_at or next(filter(None, hosts), "")
    with ExitStack() as stack:
        free = next(
            (candidate for candidate in (host, *_candidate_addresses()) if _take_if_free(candidate, stack)), host
        )
        if free != host:
            say(f"simulated laboratory: another one is at {host}, so this one is at {free}", file=sys.stderr)
        yield ([] if free == host else [*_move_turner(config, laboratory, free), *_move_ports(config, free)])


@contextmanager
def load_at_own_address(path: Path, overrides: Sequence[str]) -> Iterator[Loaded]:
    """Yield a configuration without its procedure, with a laboratory address of its own. Raise as `load` does."""
    loaded = load(path, overrides, sections=None)
    with find_own_address(loaded.config, loaded.laboratory) as moved:
        yield load(path, [*overrides, *moved], sections=None) if moved else loaded


def _candidate_addresses() -> Iterator[str]:
    """Yield loopback addresses, in a different order for every process."""
    process = os.getpid()
    for number in range(MAX_CANDIDATES):
        yield f"127.0.{1 + process // MAX_CANDIDATES % MAX_CANDIDATES}.{2 + (process + number) % MAX_CANDIDATES}"


def _take_if_free(host: str, stack: ExitStack) -> bool:
    """Claim an address, and return True, if no other rig or laboratory uses it and no program listens there."""
    with ExitStack() as claims, socket.socket() as probe:
        try:
            claims.enter_context(claim_laboratory(host))
            with claim_arm(host):
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((host, ARM_PORT))
                probe.listen()
        except (Refused, OSError):
            return False
        stack.push(claims.pop_all())
    return True


def _move_turner(config: RigConfig, text: str, host: str) -> Iterator[str]:
    """Yield the overrides that move the turner to `host`, under the key that the file has: `turner` or `arm`."""
    import yaml

    section = "turner" if "turner" in yaml.safe_load(text) else "arm"
    for key, value in config.turner.override_host(host).items():
        yield f"{section}.{key}={value}"


def _move_ports(config: SensorsConfig, host: str) -> Iterator[str]:
    """Yield the overrides that move the ports of the configuration to `host`."""
    for key, port in config.ports.items():
        yield f"{key}=socket://{host}:{urlsplit(port).port}"
