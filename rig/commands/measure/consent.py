"""Consent to the addresses in a run folder of unknown origin; by default only those of the user's own runs are used."""

import hashlib
import os
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.load import Loaded
from rig.data.run_folder import CONFIG, resuming
from rig.data.user_texts import is_own
from rig.errors import Refused
from rig.errors.quoting import quote
from rig.history.storage.address import ENVIRONMENT

CONFIG_MAX_BYTES = 10_000_000


def refuse_foreign_addresses(folder: Path, loaded: Loaded, agreed: Sequence[str] = ()) -> None:
    """Raise Refused `foreign_folder` for addresses not in `agreed`, unless this user has run the configuration here."""
    if is_own(_sha256(folder / CONFIG)):
        return
    addresses = [(what, where) for what, where in _list_addresses(loaded) if where not in agreed]
    if not addresses:
        return
    options = " ".join(f"--connect {shlex.quote(where)}" for _, where in addresses)
    raise Refused(
        "foreign_folder",
        f"the {CONFIG} in {folder} was never run by you on this computer; it would connect to "
        + ", ".join(f"{what} {where}" for what, where in addresses),
        f"If all of this is yours, state it: {resuming(folder)} {options}",
    )


def _sha256(file: Path) -> str:
    try:
        return hashlib.sha256(read_regular_file(file, CONFIG_MAX_BYTES)).hexdigest()
    except (UnfitFile, OSError):
        return ""


def _list_addresses(loaded: Loaded) -> Iterator[tuple[str, str]]:
    """Yield each device that a run would connect to, and the history, with the address.

    A simulated laboratory connects to no device, but may store its board's flash in a file, which is then listed.
    """
    config = loaded.config
    if loaded.flash_file is not None:
        yield "the file of a simulated board's flash", str(loaded.flash_file)
    if not loaded.simulated:
        if config.turner.address:
            yield "the arm", config.turner.address
        if config.board is not None:
            yield "the board", config.board.port
        for name, section in config.sensors.items():
            if section.own_port is not None:
                yield f"the sensor {name}", section.own_port[1]
    if config.history.url is not None and not config.history.is_off and not os.environ.get(ENVIRONMENT):
        yield "the history", config.history.url


def address_keys(loaded: Loaded) -> list[str]:
    """Return the keys of the addresses in a configuration: of the turner, the board, sensors with own ports."""
    import yaml

    turner = "turner" if "turner" in yaml.safe_load(loaded.text) else "arm"
    key = loaded.config.turner.address_key
    return [*([f"{turner}.{key}"] if key else []), *loaded.config.ports]


def refuse_other_changes(loaded: Loaded, overrides: Sequence[str]) -> list[str]:
    """Return the addresses in `overrides` (key=address). Raise Refused `no_address` for a key not in `address_keys`."""
    keys = address_keys(loaded)
    for override in overrides:
        key = override.partition("=")[0]
        if key not in keys:
            raise Refused(
                "no_address",
                f"--set {quote(key)} is not an address of the run, and nothing else may change",
                f"Give a new address to {', '.join(keys) or 'nothing: it has none'}, or start a new run with `rig run`",
            )
    return [override.partition("=")[2] for override in overrides]
