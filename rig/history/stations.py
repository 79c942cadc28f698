"""What each station says of itself at this moment, in a shared history: one row a rig, written anew every second.

It is no entry of the history: nothing rests on it, no journal keeps it, and its row is replaced. Ages are told by the
database's clock alone, so the computers' clocks need not agree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    Engine,
    Float,
    MetaData,
    String,
    Table,
    insert,
    inspect,
    literal_column,
    select,
    update,
)
from sqlalchemy.exc import IntegrityError, ProgrammingError

from rig.history.engine import WRITES

LONGEST = 20_000  # characters of what a station says
NAME = 200
metadata = MetaData()
station = Table(
    "station",
    metadata,
    Column("rig", String(NAME), primary_key=True),
    Column("computer", String(NAME), primary_key=True),
    Column("heard_s", Float, nullable=False),  # since 1970, by the database's clock
    Column("told", String(LONGEST), nullable=False),  # JSON
)
_NOW: Mapping[str, str] = {
    "postgresql": "extract(epoch from clock_timestamp())::double precision",
    "sqlite": "(julianday('now') - 2440587.5) * 86400.0",
}


@dataclass(frozen=True, slots=True)
class Told:
    """What the station of a `rig` on a `computer` said last, as JSON, and how long ago."""

    rig: str
    computer: str
    told: str
    age_s: float


def make_table(engine: Engine) -> None:
    """The table, where there is none. Raises SQLAlchemyError where the role may make none."""
    if inspect(engine).has_table(station.name):
        return
    try:
        with _writing(engine) as connection, connection.begin():
            metadata.create_all(connection)
    except (IntegrityError, ProgrammingError):  # another station has made it at the same moment
        if not inspect(engine).has_table(station.name):
            raise


def tell(engine: Engine, rig: str, computer: str, told: str) -> None:
    """Say it, in the place of what the station said before. Raises SQLAlchemyError."""
    with _writing(engine) as connection, connection.begin():
        row: dict[str, Any] = {"heard_s": _now(connection), "told": told[:LONGEST]}
        key = {"rig": rig[:NAME], "computer": computer[:NAME]}
        of_it = update(station).where(*(station.c[name] == value for name, value in key.items()))
        if connection.execute(of_it.values(**row)).rowcount == 0:
            connection.execute(insert(station).values(**key, **row))


def heard(engine: Engine) -> list[Told]:
    """What all stations said last, by the rig's name; nothing where none ever said anything."""
    if not inspect(engine).has_table(station.name):
        return []
    with engine.connect() as connection:
        age = _now(connection) - station.c.heard_s
        question = select(station.c.rig, station.c.computer, station.c.told, age).order_by(*station.primary_key)
        return [Told(*row) for row in connection.execute(question).all()]


def _writing(engine: Engine) -> Connection:
    return engine.connect().execution_options(**{WRITES: True})


def _now(connection: Connection) -> ColumnElement[float]:
    return literal_column(_NOW[connection.dialect.name], Float)
