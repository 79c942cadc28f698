"""Tables of columns for exports."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from rig.data.recording.channel import Channel
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array


@dataclass(frozen=True, slots=True)
class ExportTable:
    """A table: columns (n,) by name, which includes the unit, and the `meaning` of the table in words."""

    name: str
    columns: Mapping[str, Array]
    meaning: str


def readings_table(run: RunData, sensor: str, channels: Sequence[Channel], time_s: Array, meaning: str) -> ExportTable:
    """Return a table of a sensor's times (n,) and of its readings in these `channels`, with their `meaning`."""
    recorded, columns = run.sensors[sensor], {"time_s": time_s}
    for channel in channels:
        values = channel.values(run.samples[sensor])
        columns |= split(channel.measures.columns, values.reshape(len(time_s), -1))
    whose = f"{sensor}, {recorded.part} {recorded.serial_number}, {recorded.mode} readings"
    if recorded.has_axes:
        whose += " in the sensor's own axes"
    return ExportTable(sensor, columns, f"{whose}. {meaning}")


def split(names: Sequence[str], columns: Array) -> dict[str, Array]:
    """Return the columns of an array (n, k) by name."""
    return {name: columns[:, i] for i, name in enumerate(names)}


def plain_names(names: Iterable[str]) -> dict[str, str]:
    """Return a unique plain name for each name: ASCII letters, digits and `_`, beginning with a letter."""
    plain_by_name: dict[str, str] = {}
    for name in names:
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        if not plain[0].isalpha():
            plain = f"s_{plain}"
        while plain in plain_by_name.values():  # two names that differ in replaced characters
            plain += "_"
        plain_by_name[name] = plain
    return plain_by_name
