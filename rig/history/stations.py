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
    LargeBinary,
    MetaData,
    String,
    Table,
    case,
    cast,
    func,
    insert,
    inspect,
    literal_column,
    select,
    update,
)
from sqlalchemy.exc import IntegrityError, ProgrammingError

from rig.history.storage.engine import WRITES

LONGEST = 20_000  # characters of what a station says
NAME = 200
MOST = 100  # stations that are told of
SOONEST_S, LATEST_S = -1.0, 3e9  # ages that can be: clocks are corrected, and nobody told anything a century ago
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
    """What the station of a `rig` on a `computer` said last, as JSON, and how long ago; None if no time is told.

    Whoever may write to the history may have written anything there.
    """

    rig: str
    computer: str
    told: str
    age_s: float | None


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


def heard(engine: Engine) -> tuple[list[Told], int]:
    """Return what stations said last, by the rig's name, and how many more there are; none if no one ever said a word.

    Of more than `MOST` stations those that were heard last.
    """
    if not inspect(engine).has_table(station.name):
        return [], 0
    with engine.connect() as connection:
        age = _now(connection) - station.c.heard_s
        texts = (_text(connection, column, most) for column, most in _LENGTHS)
        cannot_be = case((age.between(SOONEST_S, LATEST_S), 0), else_=1)
        question = select(*texts, age).order_by(cannot_be, age, *station.primary_key).limit(MOST)
        rows: list[tuple[Any, ...]] = [tuple(row) for row in connection.execute(question)]
        every = connection.scalar(select(func.count()).select_from(station)) or 0
    told = [Told(_decoded(rig), _decoded(computer), _decoded(said), _age_s(age)) for rig, computer, said, age in rows]
    return sorted(told, key=lambda each: (each.rig, each.computer)), max(every - len(told), 0)


_LENGTHS = ((station.c.rig, NAME), (station.c.computer, NAME), (station.c.told, LONGEST + 1))


def _text(connection: Connection, column: ColumnElement[str], most: int) -> ColumnElement[Any]:
    """The beginning of a text. Of SQLite as bytes: a column holds whatever was put there, also what is no UTF-8."""
    start = func.substr(column, 1, most)
    return cast(start, LargeBinary) if connection.dialect.name == "sqlite" else start


def _decoded(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else "" if value is None else str(value)


def _age_s(value: Any) -> float | None:
    try:
        age_s = float(value)
    except (TypeError, ValueError):
        return None
    return max(age_s, 0.0) if SOONEST_S <= age_s <= LATEST_S else None


def _writing(engine: Engine) -> Connection:
    return engine.connect().execution_options(**{WRITES: True})


def _now(connection: Connection) -> ColumnElement[float]:
    return literal_column(_NOW[connection.dialect.name], Float)
