"""What `rig board` prints: the board's health and what it has stored."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from firmware_host.answers import BoardIdentity, BoardStatus, StoredCalibration
from firmware_host.protocol import FIRMWARE_VERSION
from rig.station.plain_text import plain


def info_document(
    port: str,
    identity: BoardIdentity,
    status: BoardStatus,
    configured: Sequence[str | None],
    calibrations: Sequence[StoredCalibration | None],
) -> dict[str, Any]:
    """Everything about a board as plain numbers and strings, of schema "rig.board/1".

    `configured` and `calibrations` stand beside `identity.sensors`: each one's name in the configuration and what is
    stored for it.
    """
    health = asdict(status)
    counts = health.pop("sensors")
    return {
        "schema": "rig.board/1",
        "port": port,
        "unique_id": identity.unique_id,
        "firmware": identity.firmware,
        "shipped_firmware": FIRMWARE_VERSION,
        "protocol": identity.protocol,
        "health": health,
        "sensors": [
            {
                "part": sensor.part,
                "present": sensor.present,
                "who_am_i": sensor.who_am_i,
                "configured_as": name,
                "counts": count,
                "calibration": None if stored is None else stored.document(),
            }
            for sensor, name, stored, count in zip(identity.sensors, configured, calibrations, counts, strict=True)
        ],
    }


def print_info(document: Mapping[str, Any]) -> None:
    """An `info_document` for people."""
    console = Console(highlight=False)
    health = document["health"]
    flashed = document["firmware"] == document["shipped_firmware"]
    fault = f"0x{health['fault_pc']:08x}" if health["fault_pc"] else "none"
    facts = {
        "board": f"{document['unique_id']} at {document['port']}",
        "firmware": f"{document['firmware']}, protocol {document['protocol']}"
        + ("" if flashed else f"; this program comes with {document['shipped_firmware']}: `rig board flash`"),
        "up": f"{health['uptime_s']:.1f} s, last started by: {health['reset_cause']}",
        "clock": "follows the crystal" if health["clock_locked"] else "NOT locked to the crystal: time stamps drift",
        "link": f"{health['rx_errors']} damaged requests, {health['tx_overruns']} frames without room, "
        f"{health['frames_lost']} lost on the way, {health['frames_repeated']} came twice",
        "sensor bus": f"{health['bus_errors']} failed reads",
        "stack": f"{health['stack_high_water_bytes']} bytes at most",
        "last fault": fault,
    }
    for name, value in facts.items():
        console.print(plain(f"{name + ':':12}{value}"), soft_wrap=True)
    table = Table(box=SIMPLE)
    for heading in ("part", "fitted", "identity", "configured as", "stored calibration"):
        table.add_column(heading)
    for sensor in document["sensors"]:
        stored = sensor["calibration"]
        table.add_row(
            plain(sensor["part"]),
            "yes" if sensor["present"] else "no",
            f"0x{sensor['who_am_i']:02x}",
            plain(sensor["configured_as"] or ""),
            plain("none" if stored is None else f"{stored['serial_number']}, {stored['written_utc']}"),
        )
    console.print(table)


def print_stored(documents: Mapping[str, Mapping[str, Any] | None]) -> None:
    """Stored calibrations by sensor name, for people."""
    console = Console(highlight=False)
    for name, stored in documents.items():
        if stored is None:
            console.print(plain(f"{name}: no calibration stored"))
            continue
        console.print(
            plain(
                f"{name}: {stored['part']} {stored['serial_number']} at {stored['range_deg_s']:g} °/s, "
                f"{stored['temperature_c']:.1f} °C; record {stored['sequence']} of {stored['written_utc']}"
            ),
            soft_wrap=True,
        )
        table = Table(box=SIMPLE)
        for heading in ("axis", "scale factor", "bias rad/s"):
            table.add_column(heading, justify="left" if heading == "axis" else "right")
        for axis, scale, bias in zip("xyz", stored["scale"], stored["bias_rad_s"], strict=True):
            table.add_row(axis, f"{scale:.6f}", f"{bias:+.6f}")
        console.print(table)
