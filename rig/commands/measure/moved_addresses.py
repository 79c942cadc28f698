"""The only changes allowed in a resumed run: the addresses of its devices."""

from collections.abc import Sequence

from rig.config.load import Loaded
from rig.errors import Refused
from rig.errors.quoting import quote


def address_keys(loaded: Loaded) -> list[str]:
    """Return the keys of the addresses in a configuration: of the turner, the board, sensors with own ports."""
    import yaml

    turner = "turner" if "turner" in yaml.safe_load(loaded.text) else "arm"
    key = loaded.config.turner.address_key
    return [*([f"{turner}.{key}"] if key else []), *loaded.config.ports]


def refuse_other_changes(loaded: Loaded, overrides: Sequence[str]) -> list[str]:
    """Return the addresses that `overrides` give. Raise Refused `no_address` for any other key."""
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
