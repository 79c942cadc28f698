"""What `rig kvh info` prints: the instrument's settings, its test, and what it sends."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from rich.console import Console

from rig.station.plain_text import plain


@dataclass(frozen=True, slots=True)
class KvhInfo:
    """A KVH 1775 at `port`: the settings in its memory, its built-in test, and a look at its stream.

    `rotation` and `acceleration_g` are means over `messages` as the instrument sends them; `problem` is what kept it
    from being looked at so far.
    """

    sensor: str
    port: str
    baud: int
    serial_number: str
    settings: Mapping[str, str]
    built_in_test: str | None = None
    messages: int = 0
    lost: int = 0
    rotation: tuple[float, ...] = ()
    acceleration_g: tuple[float, ...] = ()
    status: str | None = None
    problem: str | None = None


def print_kvh_info(found: KvhInfo, *, as_json: bool) -> None:
    """Print what the instrument says on stdout: lines for people, JSON of schema "rig.kvh/1" for machines."""
    if as_json:
        print(json.dumps({"schema": "rig.kvh/1", **asdict(found)}, indent=2))
        return
    console = Console(highlight=False)
    facts = {
        found.sensor: f"KVH 1775 {found.serial_number} at {found.port}, {found.baud} Bd",
        **found.settings,
        "built-in test": found.built_in_test or "no result",
    }
    if found.messages:
        unit = found.settings["ROTUNITS"].lower() + ("" if found.settings["ROTFMT"] == "DELTA" else "/s")
        facts |= {
            "stream": f"{found.messages} messages, {found.lost} lost; status {found.status}",
            "rotation": f"{_vector(found.rotation)} {unit}, the mean",
            "acceleration": f"{_vector(found.acceleration_g)} g, the mean",
        }
    for name, value in facts.items():
        console.print(plain(f"{name + ':':15}{value}"), soft_wrap=True)


def _vector(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:+.6g}" for value in values)
