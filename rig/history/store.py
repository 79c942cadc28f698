"""A history: runs are entered and read.

with open_history() as history:                    # or open_history("postgresql://rig@lab-server/history")
    for past in history.calibrations(Selection(serial_number="LSM9DS1-001")):
        print(past.started_utc, past.value("kx"), past.parameters["kx"].expanded)
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from datetime import date
from typing import Any

from sqlalchemy import Connection, Engine, Select, and_, exists, insert, or_, select
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from rig.data.run_folder import RESULT
from rig.errors import Refused
from rig.history.entered import certificates
from rig.history.entered.entering import enter_run, note_place, now_utc
from rig.history.entered.finished_run import EnteredRecording, FinishedRun
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.storage import journal, read_back, row_numbers, schema, triggers
from rig.history.storage.address import HistoryAddress, resolve_address
from rig.history.storage.engine import connection_apart, engine_of
from rig.history.storage.sqlite_engine import WRITE_OPTION
from rig.report.findings.characteristics import every_characteristic
from rig.report.findings.history_records import BIASES, SCALES, Parameter

_MANY = 500  # keys in one query: SQLite allows a few thousand


@dataclass(frozen=True, slots=True)
class Selection:
    """A selection of calibrations; None selects all. `rig` is a name or an arm's serial number, `board` a unique ID."""

    serial_number: str | None = None
    part: str | None = None
    since: date | None = None
    rig: str | None = None
    board: str | None = None


@dataclass(frozen=True, slots=True)
class Past:
    """A calibration of the history. `id` is its number, `run_id` the number of its run.

    `voided` is the reason why it is void, None if it is valid.
    """

    id: int
    run_id: int
    started_utc: str
    rig: str
    arm_serial_number: str
    board_unique_id: str
    verdict: str
    fit: bool
    simulated: bool
    sensor: str
    quantity: str
    part: str
    serial_number: str
    full_scale: float
    estimator: str
    temperature_c: float | None
    check_standard: bool
    operator: str | None
    note: str | None
    voided: str | None
    parameters: Mapping[str, Parameter]

    @property
    def subject(self) -> tuple[str, str, str, float, bool]:
        """The constants of a series: part, serial number, quantity, range, and whether it is simulated."""
        return self.part, self.serial_number, self.quantity, self.full_scale, self.simulated

    def value(self, name: str) -> float:
        """Return the value of the parameter `name`. Raise KeyError."""
        return self.parameters[name].value


@dataclass(frozen=True, slots=True)
class EnteredRun:
    """The number of a run; `new` is False if the history already had it."""

    run_id: int
    new: bool


@dataclass(frozen=True, slots=True)
class KeptRun:
    """A run as it was entered.

    - `result`: the text of result.json; `content_sha256`: its checksum.
    - `recordings`: name, size and SHA-256 of each recording; `documents`: name and SHA-256 of each other file.
    - `places`: computer and path of each location of its folder, the newest first.
    - `certificates`: in the order of entry.
    - `row`: all other columns of the run's row.
    """

    run_id: int
    content_sha256: str
    result: str
    recordings: tuple[EnteredRecording, ...]
    places: tuple[tuple[str, str], ...]
    certificates: tuple[IssuedCertificate, ...]
    documents: tuple[tuple[str, str], ...]
    row: Mapping[str, Any]


@contextmanager
def open_history(where: str | HistoryAddress | None = None) -> Iterator["History"]:
    """Open the history at a file or URL, by default the user's own, for the block; make or migrate its tables.

    Raise Refused `history_unreachable`, `history_too_old`, `history_too_new`, `not_a_history`, `missing_extra`;
    `history_gone` or `history_exchanged` if this process has opened it before and it is missing or has been replaced.
    """
    address = where if isinstance(where, HistoryAddress) else resolve_address(where)
    try:
        with engine_of(address) as engine:
            yield History(address, engine)
    except (SQLAlchemyError, OSError) as error:
        why = str(getattr(error, "orig", None) or error).strip().splitlines()
        raise Refused(
            "history_unreachable",
            f"the history {address.label} cannot be used: {why[0] if why else type(error).__name__}",
            "Correct that, or name another history with --history or RIG_HISTORY; runs are entered later by "
            "`rig history import`",
        ) from error


@dataclass(frozen=True, slots=True)
class History:
    """An open history.

    Before a method that enters something returns, another connection reads the entry back. If the entry is missing, the
    method raises Refused `entry_not_kept`.
    """

    address: HistoryAddress
    engine: Engine

    def enter(self, finished: FinishedRun) -> EnteredRun:
        """Add a run and return its entry; if the history already has it, add only a new location of its folder.

        Unlike `rig history import`, this does not compare the result with its recordings. Raise Refused
        `entry_not_kept`.
        """
        content = finished.content_sha256
        try:
            with self._writing() as connection:
                existing = self._run_id(connection, content)
                run_id = enter_run(connection, finished, content) if existing is None else existing
                note_place(connection, run_id, finished)
                if finished.certificate is not None:
                    certificates.enter(connection, run_id, finished.certificate, now_utc())
            entered = EnteredRun(run_id, existing is None)
        except IntegrityError:
            # Another process entered the same run first.
            with self.engine.connect() as connection:
                existing = self._run_id(connection, content)
            if existing is None:
                raise
            entered = EnteredRun(existing, False)
        if not entered.new:
            with connection_apart(self.engine) as connection:
                read_back.refuse_missing(connection, self.address, schema.run, entered.run_id)
        return entered

    def has(self, content_sha256: str) -> bool:
        """Return whether a run with this result was entered."""
        with self.engine.connect() as connection:
            return self._run_id(connection, content_sha256) is not None

    def certify(self, content_sha256: str, certificate: IssuedCertificate) -> bool:
        """Add a run's certificate; return False if the run is not in the history. Raise Refused `entry_not_kept`."""
        with self._writing() as connection:
            run_id = self._run_id(connection, content_sha256)
            if run_id is not None:
                certificates.enter(connection, run_id, certificate, now_utc())
            return run_id is not None

    def calibrations(self, selection: Selection = Selection(), *, replaced_too: bool = False) -> list[Past]:
        """Return calibrations in the order of time, including voided ones.

        A calibration is replaced by a later result of the same measurement. With `replaced_too`, replaced ones are
        included.
        """
        question = select(*_COLUMNS).select_from(_ROWS).order_by(*_IN_TIME)
        return self._pasts(chosen(question if replaced_too else question.where(~replacement_condition()), selection))

    def calibration(self, number: int) -> Past:
        """Return one calibration by its number, replaced or not. Raise Refused `not_in_history`."""
        pasts = self._pasts(select(*_COLUMNS).select_from(_ROWS).where(schema.calibration.c.id == number))
        if not pasts:
            raise Refused("not_in_history", f"there is no calibration number {number}", "Look with `rig history`")
        return pasts[0]

    def select_run(self, run_id: int) -> list[Past]:
        """Return all calibrations of one run."""
        return self._pasts(select(*_COLUMNS).select_from(_ROWS).where(_RUN.id == run_id).order_by(*_IN_TIME))

    def void(self, number: int, reason: str) -> None:
        """Mark the calibration `number` as void. Raise Refused `not_in_history`, `already_voided`, `entry_not_kept`."""
        before = self.calibration(number).voided
        if before is not None:
            raise Refused(
                "already_voided",
                f"calibration {number} is void: {before}",
                "Look at it with `rig history show`",
            )
        with self._writing() as connection:
            row = {"calibration_id": number, "reason": reason, "voided_utc": now_utc()}
            connection.execute(insert(schema.voided).values(row))
            journal.note(connection, schema.voided, number)

    def kept(self, run_id: int | None = None) -> Iterator[KeptRun]:
        """Yield the run `run_id`, or by default all runs in the order of entry, as they were entered."""
        question = select(schema.run).order_by(schema.run.c.id)
        if run_id is not None:
            question = question.where(schema.run.c.id == run_id)
        with self.engine.connect() as connection:
            numbers = [row.id for row in connection.execute(question.with_only_columns(schema.run.c.id)).all()]
            for number in numbers:
                yield _read_kept(connection, number)

    def files(self) -> Iterator[tuple[str, str, str]]:
        """Yield path, name and SHA-256 of all files of runs, at each location of their folders."""
        places, files = schema.location, schema.certificate_file
        recorded = places.join(schema.recording, schema.recording.c.run_id == places.c.run_id)
        documented = places.join(schema.document, schema.document.c.run_id == places.c.run_id)
        issued = places.join(schema.certificate, schema.certificate.c.run_id == places.c.run_id).join(files)
        with self.engine.connect() as connection:
            for table, joined in ((schema.recording, recorded), (schema.document, documented), (files, issued)):
                yield from map(
                    tuple, connection.execute(select(places.c.path, table.c.name, table.c.sha256).select_from(joined))
                )
            result = select(places.c.path, schema.run.c.content_sha256).select_from(places.join(schema.run))
            yield from ((path, RESULT, sha256) for path, sha256 in connection.execute(result))

    def broken(self) -> Iterator[journal.Broken]:
        """Yield changed triggers, gaps in the row numbers, and the broken rows that `journal.broken` finds."""
        with self.engine.connect() as connection:
            yield from triggers.unlike_made(connection)
            yield from row_numbers.gaps(connection)
            yield from journal.broken(connection)

    def head(self) -> journal.Head:
        """Return the last line of the journal, with which a later check shows whether the journal was rewritten."""
        with self.engine.connect() as connection:
            return journal.head(connection)

    def holds(self, earlier: journal.Head) -> bool:
        """Return whether all lines of the journal up to an earlier end are unchanged."""
        with self.engine.connect() as connection:
            return journal.holds(connection, earlier)

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        """Yield the connection of a transaction that enters rows, and read the rows back after it."""
        with self.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection, connection.begin():
            journal.lock_out_writers(connection)
            before = journal.head(connection)
            yield connection
            after = journal.head(connection)
        with connection_apart(self.engine) as connection:
            read_back.refuse_lost(connection, self.address, before, after)

    @staticmethod
    def _run_id(connection: Connection, content_sha256: str) -> int | None:
        number: int | None = connection.scalar(
            select(schema.run.c.id).where(schema.run.c.content_sha256 == content_sha256)
        )
        return number

    def _pasts(self, question: Select[*tuple[Any, ...]]) -> list[Past]:
        with self.engine.connect() as connection:
            rows = connection.execute(question).all()
            parameters = _parameters(connection, [row.id for row in rows])
        return [Past(**row._asdict(), parameters=parameters.get(row.id, {})) for row in rows]


_RUN, _CALIBRATION = schema.run.c, schema.calibration.c
# The fields of `Past` are columns of a calibration, or else of its run.
_COLUMNS = (
    *((_CALIBRATION if field.name in _CALIBRATION else _RUN)[field.name] for field in fields(Past)[:-2]),
    schema.voided.c.reason.label("voided"),
)
_ROWS = schema.run.join(schema.calibration).outerjoin(schema.voided)
_IN_TIME = (_RUN.started_utc, _RUN.id, _CALIBRATION.id)


def _read_kept(connection: Connection, number: int) -> KeptRun:
    places, files, documents = schema.location.c, schema.recording.c, schema.document.c
    row = connection.execute(select(schema.run).where(_RUN.id == number)).mappings().one()
    locations = select(places.computer, places.path).where(places.run_id == number).order_by(places.id.desc())
    recorded = select(files.name, files.bytes, files.sha256).where(files.run_id == number).order_by(files.name)
    documented = select(documents.name, documents.sha256).where(documents.run_id == number).order_by(documents.name)
    return KeptRun(
        number,
        row["content_sha256"],
        row["result"],
        tuple(EnteredRecording(*row) for row in connection.execute(recorded)),
        tuple((computer, path) for computer, path in connection.execute(locations)),
        certificates.select_run(connection, number),
        tuple((name, sha256) for name, sha256 in connection.execute(documented)),
        dict(row),
    )


def replacement_condition() -> Any:
    """Return the SQL condition under which a later result of the same measurement replaces a run's row."""
    later = schema.run.alias("later")
    newer = or_(later.c.solved_utc > _RUN.solved_utc, and_(later.c.solved_utc == _RUN.solved_utc, later.c.id > _RUN.id))
    return exists(select(later.c.id).where(later.c.measurement_sha256 == _RUN.measurement_sha256, newer))


def chosen(question: Select[*tuple[Any, ...]], selection: Selection) -> Select[*tuple[Any, ...]]:
    """Return `question`, a query for runs or for their calibrations, restricted to the selection."""
    if selection.serial_number is not None:
        question = question.where(_CALIBRATION.serial_number == selection.serial_number)
    if selection.part is not None:
        question = question.where(_CALIBRATION.part == selection.part)
    if selection.since is not None:
        question = question.where(_RUN.started_utc >= selection.since.isoformat())
    if selection.rig is not None:
        question = question.where(or_(_RUN.rig == selection.rig, _RUN.arm_serial_number == selection.rig))
    if selection.board is not None:
        question = question.where(_RUN.board_unique_id == selection.board)
    return question


def _parameters(connection: Connection, numbers: Sequence[int]) -> dict[int, dict[str, Parameter]]:
    """Return the parameters of calibrations, by calibration number, in the order of display."""
    columns, by_number = schema.parameter.c, dict[int, dict[str, Parameter]]()
    for start in range(0, len(numbers), _MANY):
        batch = numbers[start : start + _MANY]
        for row in connection.execute(select(schema.parameter).where(columns.calibration_id.in_(batch))):
            number, name, *values = row
            by_number.setdefault(number, {})[name] = Parameter(name, *values)
    order = _order()
    positions = {name: position for position, name in enumerate(order)}

    def sort_key(parameter: tuple[str, Parameter]) -> tuple[int, str]:
        return positions.get(parameter[0], len(order)), parameter[0]

    return {number: dict(sorted(by_name.items(), key=sort_key)) for number, by_name in by_number.items()}


def _order() -> list[str]:
    """Return the parameters in their order of display, unknown ones last."""
    further = (name for characteristic in every_characteristic() for name in characteristic.parameters)
    return list(dict.fromkeys([*SCALES, *BIASES, *further]))
