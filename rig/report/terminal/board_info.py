"""Output of `rig board`: the board's health and its stored calibrations."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from firmware_host.answers import (
    BoardIdentity,
    BoardStatus,
    SensorCounts,
    SensorInfo,
    StoredCalibration,
    StoredPolynomials,
)
from firmware_host.protocol import FIRMWARE_VERSION
from rig.station.plain_text import build_number_table, plain

NO_ANSWER = (0x00, 0xFF, 0xFFFF)  # readings of a bus that does not answer, of one byte and of two


@dataclass(frozen=True, slots=True)
class BoardSensorRow:
    """A sensor that the firmware supports, its sample `counts`, its configured name and stored calibration, if any."""

    info: SensorInfo
    configured_as: str | None
    counts: SensorCounts
    stored: StoredCalibration | None


@dataclass(frozen=True, slots=True)
class BoardInfo:
    """The board at `port`: its identity, its status and its sensors."""

    port: str
    identity: BoardIdentity
    status: BoardStatus
    sensors: tuple[BoardSensorRow, ...]


def print_info(board: BoardInfo, *, as_json: bool) -> None:
    """Print the board on stdout: a table for people, JSON of schema "rig.board/1" for machines."""
    if as_json:
        print(json.dumps(_info_document(board), indent=2))
    else:
        _print_info(board)


def print_stored(stored: Mapping[str, StoredCalibration | None], *, as_json: bool) -> None:
    """Print stored calibrations by sensor: tables for people, JSON of schema "rig.board_calibration/1" for machines."""
    if as_json:
        print(json.dumps({"schema": "rig.board_calibration/1", "sensors": _documents(stored)}, indent=2))
    else:
        _print_stored(stored)


def _documents(stored: Mapping[str, StoredCalibration | None]) -> dict[str, Any]:
    return {name: None if record is None else record.document() for name, record in stored.items()}


def _info_document(board: BoardInfo) -> dict[str, Any]:
    health = asdict(board.status)
    del health["sensors"]  # listed with the sensors
    return {
        "schema": "rig.board/1",
        "port": board.port,
        "unique_id": board.identity.unique_id,
        "firmware": board.identity.firmware,
        "shipped_firmware": FIRMWARE_VERSION,
        "protocol": board.identity.protocol,
        "health": health,
        "sensors": [
            {
                "part": sensor.info.part,
                "quantity": sensor.info.quantity,
                "present": sensor.info.present,
                "who_am_i": sensor.info.who_am_i,
                "configured_as": sensor.configured_as,
                "counts": asdict(sensor.counts),
                **_documents({"calibration": sensor.stored}),
            }
            for sensor in board.sensors
        ],
    }


def _print_info(board: BoardInfo) -> None:
    """Print the board's identity and health as lines, and its sensors as a table."""
    console = Console(highlight=False)
    identity, health = board.identity, board.status
    flashed = identity.firmware == FIRMWARE_VERSION
    facts = {
        "board": f"{identity.unique_id} at {board.port}",
        "firmware": f"{identity.firmware}, protocol {identity.protocol}"
        + ("" if flashed else f"; this program comes with {FIRMWARE_VERSION}: `rig board flash`"),
        "uptime": f"{health.uptime_s:.1f} s, last reset: {health.reset_cause}",
        "clock": "follows the crystal"
        if health.clock_locked
        else "NOT locked to the crystal: time stamps may be 1 % off; a bridge on the Nucleo connects the crystal",
        "link": f"{health.rx_errors} damaged requests, {health.tx_overruns} frames without room, "
        f"{health.frames_lost} lost, {health.frames_repeated} repeated",
        "sensor bus": f"{health.bus_errors} failed reads",
        "stack": f"{health.stack_high_water_bytes} bytes at most",
        "last fault": f"0x{health.fault_pc:08x}" if health.fault_pc else "none",
    }
    for name, value in facts.items():
        console.print(plain(f"{name + ':':12}{value}"), soft_wrap=True)
    table = Table("part", "measures", "fitted", "identity", "configured as", "stored calibration", box=SIMPLE)
    for sensor in board.sensors:
        table.add_row(
            plain(sensor.info.part),
            sensor.info.quantity,
            "yes" if sensor.info.present else "not fitted",
            "" if sensor.info.who_am_i in NO_ANSWER and not sensor.info.present else f"0x{sensor.info.who_am_i:02x}",
            plain(sensor.configured_as or ""),
            plain(
                "none"
                if sensor.stored is None
                else f"{sensor.stored.calibration.serial_number}, {_written(sensor.stored)}"
            ),
        )
    console.print(table)


def _print_stored(stored: Mapping[str, StoredCalibration | None]) -> None:
    console = Console(highlight=False)
    for name, record in stored.items():
        if record is None:
            console.print(plain(f"{name}: no calibration stored"))
            continue
        calibration = record.calibration
        console.print(
            plain(
                f"{name}: {record.part} {calibration.serial_number} at {record.range_deg_s:g} °/s, "
                f"{calibration.temperature_c:.1f} °C; record {record.sequence} of {_written(record)}"
            ),
            soft_wrap=True,
        )
        has_matrix = calibration.model == "matrix_times_m_plus_b"
        matrix = ("matrix", "", "") if has_matrix else ()
        table = build_number_table(("axis", "scale factor", "bias rad/s", *matrix), box=SIMPLE)
        rows = zip("xyz", calibration.scale, calibration.bias_rad_s, calibration.matrix, strict=True)
        for axis, scale, bias, row in rows:
            elements = (f"{element:+.6f}" for element in row) if has_matrix else ()
            table.add_row(axis, f"{scale:.6f}", f"{bias:+.6f}", *elements)
        console.print(table)
        if calibration.polynomials is not None:
            _print_polynomials(console, calibration.polynomials)


def _print_polynomials(console: Console, polynomials: StoredPolynomials) -> None:
    low, high = polynomials.range_c
    words = "for each power of kelvins, as a fraction of the scale, and rad/s"
    console.print(f"corrected by temperature from {low:.1f} to {high:.1f} °C; {words}:", soft_wrap=True)
    headings = ("power", "scale x", "scale y", "scale z", "bias x", "bias y", "bias z")
    table = build_number_table(headings, box=SIMPLE)
    for power, rows in enumerate(zip(polynomials.scale_change, polynomials.bias_change_rad_s, strict=True), start=1):
        table.add_row(str(power), *(f"{value:+.2e}" for row in rows for value in row))
    console.print(table)


def _written(record: StoredCalibration) -> str:
    return record.calibration.written_utc.isoformat(timespec="seconds")
