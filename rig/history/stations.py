"""The present state of each station in a shared history: one row for each rig, replaced every second.

It is not an entry of the history: no result depends on it, and no journal contains it. Ages are by the database's clock
alone, so the computers' clocks need not agree.
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

from rig.history.storage.sqlite_engine import WRITE_OPTION

MAX_STATE = 20_000  # characters of a station
MAX_NAME = 200
MAX_STATIONS = 100  # that are read
MIN_AGE_S, MAX_AGE_S = -1.0, 3e9  # clocks may be corrected, and no station is a century old
metadata = MetaData()
station = Table(
    "station",
    metadata,
    Column("rig", String(MAX_NAME), primary_key=True),
    Column("computer", String(MAX_NAME), primary_key=True),
    Column("heard_s", Float, nullable=False),  # seconds since 1970, by the database's clock
    Column("told", String(MAX_STATE), nullable=False),  # JSON
)
_NOW: Mapping[str, str] = {
    "postgresql": "extract(epoch from clock_timestamp())::double precision",
    "sqlite": "(julianday('now') - 2440587.5) * 86400.0",
}


@dataclass(frozen=True, slots=True)
class StationState:
    """The last `state`, as JSON, that a station stored: the station of this `rig` on this `computer`.

    `age_s` is the age of the state, None if unknown. Every user with write access to the history can change a station's
    state.
    """

    rig: str
    computer: str
    state: str
    age_s: float | None


def make_table(engine: Engine) -> None:
    """Make the table of stations if it does not exist. Raise SQLAlchemyError if the role may not make one."""
    if inspect(engine).has_table(station.name):
        return
    try:
        with _writing(engine) as connection, connection.begin():
            metadata.create_all(connection)
    except (IntegrityError, ProgrammingError):  # another station has created the table at the same time
        if not inspect(engine).has_table(station.name):
            raise


def tell(engine: Engine, rig: str, computer: str, state: str) -> None:
    """Store the station's state in place of its previous one. Raise SQLAlchemyError."""
    with _writing(engine) as connection, connection.begin():
        row: dict[str, Any] = {"heard_s": _now(connection), "told": state[:MAX_STATE]}
        key = {"rig": rig[:MAX_NAME], "computer": computer[:MAX_NAME]}
        own_row = update(station).where(*(station.c[name] == value for name, value in key.items()))
        if connection.execute(own_row.values(**row)).rowcount == 0:
            connection.execute(insert(station).values(**key, **row))


def heard(engine: Engine) -> tuple[list[StationState], int]:
    """Return the last states of stations, sorted by rig, and the number of further stations.

    At most `MAX_STATIONS` stations, the latest, are returned.
    """
    if not inspect(engine).has_table(station.name):
        return [], 0
    with engine.connect() as connection:
        age = _now(connection) - station.c.heard_s
        texts = (_text(connection, column, most) for column, most in _LENGTHS)
        implausible = case((age.between(MIN_AGE_S, MAX_AGE_S), 0), else_=1)
        question = select(*texts, age).order_by(implausible, age, *station.primary_key).limit(MAX_STATIONS)
        rows: list[tuple[Any, ...]] = [tuple(row) for row in connection.execute(question)]
        every = connection.scalar(select(func.count()).select_from(station)) or 0
    states = [
        StationState(_decode(rig), _decode(computer), _decode(text), _age_s(age)) for rig, computer, text, age in rows
    ]
    return sorted(states, key=lambda state: (state.rig, state.computer)), max(every - len(states), 0)


_LENGTHS = ((station.c.rig, MAX_NAME), (station.c.computer, MAX_NAME), (station.c.told, MAX_STATE + 1))


def _text(connection: Connection, column: ColumnElement[str], most: int) -> ColumnElement[Any]:
    """Return a text's first `most` characters; from SQLite as bytes, because its columns may hold invalid UTF-8."""
    start = func.substr(column, 1, most)
    return cast(start, LargeBinary) if connection.dialect.name == "sqlite" else start


def _decode(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else "" if value is None else str(value)


def _age_s(value: Any) -> float | None:
    try:
        age_s = float(value)
    except (TypeError, ValueError):
        return None
    return max(age_s, 0.0) if MIN_AGE_S <= age_s <= MAX_AGE_S else None


def _writing(engine: Engine) -> Connection:
    return engine.connect().execution_options(**{WRITE_OPTION: True})


def _now(connection: Connection) -> ColumnElement[float]:
    return literal_column(_NOW[connection.dialect.name], Float)
