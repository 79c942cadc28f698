"""Output of `rig kvh info`: the instrument's settings, its built-in test, and its stream."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from rich.console import Console

from rig.station.plain_text import plain


@dataclass(frozen=True, slots=True)
class KvhInfo:
    """A KVH 1775 and its stream.

    - sensor: the sensor's name.
    - port, baud: its serial line.
    - serial_number: the instrument's serial number.
    - settings: the settings in its memory.
    - built_in_test: the result of its built-in test, None without one.
    - messages, lost: numbers of received and lost messages.
    - rotation, acceleration_g (3,): means over the messages, in the instrument's units.
    - status: the status in the messages, None without messages.
    - problem: why no stream was received; None if one was.
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


def print_kvh_info(info: KvhInfo, *, as_json: bool) -> None:
    """Print the instrument on stdout: lines for people, JSON of schema "rig.kvh/1" for machines."""
    if as_json:
        print(json.dumps({"schema": "rig.kvh/1", **asdict(info)}, indent=2))
        return
    console = Console(highlight=False)
    facts = {
        info.sensor: f"KVH 1775 {info.serial_number} at {info.port}, {info.baud} Bd",
        **info.settings,
        "built-in test": info.built_in_test or "no result",
    }
    if info.messages:
        unit = info.settings["ROTUNITS"].lower() + ("" if info.settings["ROTFMT"] == "DELTA" else "/s")
        facts |= {
            "stream": f"{info.messages} messages, {info.lost} lost; status {info.status}",
            "rotation": f"{_vector(info.rotation)} {unit} (mean)",
            "acceleration": f"{_vector(info.acceleration_g)} g (mean)",
        }
    for name, value in facts.items():
        console.print(plain(f"{name + ':':15}{value}"), soft_wrap=True)


def _vector(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:+.6g}" for value in values)
