"""A history: runs are entered, and found again.

with open_history() as history:                    # or open_history("postgresql://rig@lab-server/history")
    for each in history.calibrations(Selection(serial_number="LSM9DS1-001")):
        print(each.started_utc, each.value("kx"), each.parameters["kx"].expanded)
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date
from typing import Any

from sqlalchemy import Connection, Engine, Select, and_, exists, insert, or_, select
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from rig.data.run_folder import RESULT
from rig.errors import Refused
from rig.history.entered import certificates
from rig.history.entered.entering import enter_run, note_place, now_utc
from rig.history.entered.finished import Finished, Recording
from rig.history.entered.issued import Issued
from rig.history.storage import journal, numbers, read_back, schema, triggers
from rig.history.storage.address import Place, place
from rig.history.storage.engine import WRITES, connection_apart, engine_of
from rig.report.findings.characteristics import every_characteristic
from rig.report.findings.followed import BIASES, SCALES, Parameter

_MANY = 500  # keys in one question: SQLite takes no more than some thousands


@dataclass(frozen=True, slots=True)
class Selection:
    """Which calibrations; None is all. `rig` is its name or its arm's serial number, `board` that board's own."""

    serial_number: str | None = None
    part: str | None = None
    since: date | None = None
    rig: str | None = None
    board: str | None = None


@dataclass(frozen=True, slots=True)
class Past:
    """A calibration of long ago or of just now. `id` names it, `run_id` the run it was part of.

    `voided` is why it does not count, None where it does.
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
        """What stays the same over the years: part, serial number, quantity, range, and whether it is simulated."""
        return self.part, self.serial_number, self.quantity, self.full_scale, self.simulated

    def value(self, name: str) -> float:
        """The value of the parameter `name`. Raises KeyError."""
        return self.parameters[name].value


@dataclass(frozen=True, slots=True)
class Entered:
    """The run's `run_id`; `new` is False where the history had it already."""

    run_id: int
    new: bool


@dataclass(frozen=True, slots=True)
class Kept:
    """A run as it was entered: its result, its recordings, and where its folder was seen, the newest place first.

    `certificates` in the order they were entered; `documents` the other files of its folder, name and SHA-256; `row`
    all that stands beside the result.
    """

    run_id: int
    content_sha256: str
    result: str
    recordings: tuple[Recording, ...]
    places: tuple[tuple[str, str], ...]
    certificates: tuple[Issued, ...]
    documents: tuple[tuple[str, str], ...]
    row: Mapping[str, Any]


@contextmanager
def open_history(where: str | Place | None = None) -> Iterator["History"]:
    """Open a history by its file or URL, the user's own by default; its tables are made or migrated if need be.

    Raises Refused `history_unreachable`, `history_too_old`, `history_too_new`, `not_a_history`, `missing_extra`;
    `history_gone` or `history_exchanged` if this process has opened it before, and it is not there any more or another
    is.
    """
    found = where if isinstance(where, Place) else place(where)
    try:
        with engine_of(found) as engine:
            yield History(found, engine)
    except (SQLAlchemyError, OSError) as error:
        why = str(getattr(error, "orig", None) or error).strip().splitlines()
        raise Refused(
            "history_unreachable",
            f"the history {found.label} cannot be used: {why[0] if why else type(error).__name__}",
            "Correct that, or name another history with --history or RIG_HISTORY; runs are entered later by "
            "`rig history import`",
        ) from error


@dataclass(frozen=True, slots=True)
class History:
    """An open history. A connection of its own has read back what the methods say is entered, or `entry_not_kept`."""

    place: Place
    engine: Engine

    def enter(self, finished: Finished) -> Entered:
        """Add a run; one that is there already only gets the place of its folder noted, if that is another.

        It is taken at its word: whether its recordings give its result, `rig history import` finds out. Raises Refused
        `entry_not_kept`.
        """
        content = finished.content_sha256
        try:
            with self._writing() as connection:
                known = self._run_id(connection, content)
                run_id = enter_run(connection, finished, content) if known is None else known
                note_place(connection, run_id, finished)
                if finished.certificate is not None:
                    certificates.enter(connection, run_id, finished.certificate, now_utc())
            entered = Entered(run_id, known is None)
        except IntegrityError:
            # Somebody else entered the same at the same moment, and was first.
            with self.engine.connect() as connection:
                known = self._run_id(connection, content)
            if known is None:
                raise
            entered = Entered(known, False)
        if not entered.new:
            with connection_apart(self.engine) as connection:
                read_back.refuse_missing(connection, self.place, schema.run, entered.run_id)
        return entered

    def has(self, content_sha256: str) -> bool:
        """Whether a run with that result was entered."""
        with self.engine.connect() as connection:
            return self._run_id(connection, content_sha256) is not None

    def certify(self, content_sha256: str, certificate: Issued) -> bool:
        """Note a certificate of the run with that result; False where the history does not have it.

        Raises Refused `entry_not_kept`.
        """
        with self._writing() as connection:
            run_id = self._run_id(connection, content_sha256)
            if run_id is not None:
                certificates.enter(connection, run_id, certificate, now_utc())
            return run_id is not None

    def calibrations(self, selection: Selection = Selection(), *, replaced_too: bool = False) -> list[Past]:
        """Calibrations in the order of time, voided ones too.

        One that a later one of its run replaced is left out, unless it is asked for.
        """
        question = select(*_COLUMNS).select_from(_ROWS).order_by(*_IN_TIME)
        return self._pasts(chosen(question if replaced_too else question.where(~replaced()), selection))

    def calibration(self, number: int) -> Past:
        """One by its number, replaced or not. Raises Refused `not_in_history`."""
        found = self._pasts(select(*_COLUMNS).select_from(_ROWS).where(schema.calibration.c.id == number))
        if not found:
            raise Refused("not_in_history", f"there is no calibration number {number}", "Look with `rig history`")
        return found[0]

    def of_run(self, run_id: int) -> list[Past]:
        """All of one run."""
        return self._pasts(select(*_COLUMNS).select_from(_ROWS).where(_RUN.id == run_id).order_by(*_IN_TIME))

    def void(self, number: int, reason: str) -> None:
        """Say that a calibration does not count, and why.

        Raises Refused `not_in_history`, `already_voided`, `entry_not_kept`.
        """
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

    def kept(self, run_id: int | None = None) -> Iterator[Kept]:
        """Runs as they were entered, one or all, in the order they were."""
        question = select(schema.run).order_by(schema.run.c.id)
        if run_id is not None:
            question = question.where(schema.run.c.id == run_id)
        with self.engine.connect() as connection:
            numbers = [row.id for row in connection.execute(question.with_only_columns(schema.run.c.id)).all()]
            for number in numbers:
                yield _kept(connection, number)

    def files(self) -> Iterator[tuple[str, str, str]]:
        """Where runs were seen, and what lies there: path, name, SHA-256."""
        places, files = schema.location, schema.certificate_file
        recorded = places.join(schema.recording, schema.recording.c.run_id == places.c.run_id)
        beside = places.join(schema.document, schema.document.c.run_id == places.c.run_id)
        issued = places.join(schema.certificate, schema.certificate.c.run_id == places.c.run_id).join(files)
        with self.engine.connect() as connection:
            for table, of in ((schema.recording, recorded), (schema.document, beside), (files, issued)):
                yield from map(
                    tuple, connection.execute(select(places.c.path, table.c.name, table.c.sha256).select_from(of))
                )
            result = select(places.c.path, schema.run.c.content_sha256).select_from(places.join(schema.run))
            yield from ((path, RESULT, sha256) for path, sha256 in connection.execute(result))

    def broken(self) -> Iterator[journal.Broken]:
        """What is not as it was entered: triggers, numbers, and rows as `journal.broken`."""
        with self.engine.connect() as connection:
            yield from triggers.unlike_made(connection)
            yield from numbers.gaps(connection)
            yield from journal.broken(connection)

    def head(self) -> journal.Head:
        """The end of the journal, as `journal.head`."""
        with self.engine.connect() as connection:
            return journal.head(connection)

    def holds(self, known: journal.Head) -> bool:
        """Whether the journal still goes on from what was its end once, as `journal.holds`."""
        with self.engine.connect() as connection:
            return journal.holds(connection, known)

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        """A transaction that enters something; when it has ended, its entries are read back."""
        with self.engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
            journal.alone(connection)
            before = journal.head(connection)
            yield connection
            after = journal.head(connection)
        with connection_apart(self.engine) as connection:
            read_back.refuse_lost(connection, self.place, before, after)

    @staticmethod
    def _run_id(connection: Connection, content_sha256: str) -> int | None:
        found: int | None = connection.scalar(
            select(schema.run.c.id).where(schema.run.c.content_sha256 == content_sha256)
        )
        return found

    def _pasts(self, question: Select[Any]) -> list[Past]:
        with self.engine.connect() as connection:
            rows = connection.execute(question).all()
            parameters = _parameters(connection, [row.id for row in rows])
        return [Past(**row._mapping, parameters=parameters.get(row.id, {})) for row in rows]


_RUN, _CALIBRATION = schema.run.c, schema.calibration.c
_COLUMNS = (
    _CALIBRATION.id,
    _CALIBRATION.run_id,
    _RUN.started_utc,
    _RUN.rig,
    _RUN.arm_serial_number,
    _RUN.board_unique_id,
    _RUN.verdict,
    _RUN.fit,
    _RUN.simulated,
    _CALIBRATION.sensor,
    _CALIBRATION.quantity,
    _CALIBRATION.part,
    _CALIBRATION.serial_number,
    _CALIBRATION.full_scale,
    _CALIBRATION.estimator,
    _CALIBRATION.temperature_c,
    _CALIBRATION.check_standard,
    _RUN.operator,
    _RUN.note,
    schema.voided.c.reason.label("voided"),
)
_ROWS = schema.run.join(schema.calibration).outerjoin(schema.voided)
_IN_TIME = (_RUN.started_utc, _RUN.id, _CALIBRATION.id)


def _kept(connection: Connection, number: int) -> Kept:
    places, files, documents = schema.location.c, schema.recording.c, schema.document.c
    row = connection.execute(select(schema.run).where(_RUN.id == number)).mappings().one()
    seen = select(places.computer, places.path).where(places.run_id == number).order_by(places.id.desc())
    had = select(files.name, files.bytes, files.sha256).where(files.run_id == number).order_by(files.name)
    beside = select(documents.name, documents.sha256).where(documents.run_id == number).order_by(documents.name)
    return Kept(
        number,
        row["content_sha256"],
        row["result"],
        tuple(Recording(*each) for each in connection.execute(had)),
        tuple((computer, path) for computer, path in connection.execute(seen)),
        certificates.of_run(connection, number),
        tuple((name, sha256) for name, sha256 in connection.execute(beside)),
        dict(row),
    )


def replaced() -> Any:
    """Whether there is a later result of the same measurement, of a row of the runs."""
    later = schema.run.alias("later")
    newer = or_(later.c.solved_utc > _RUN.solved_utc, and_(later.c.solved_utc == _RUN.solved_utc, later.c.id > _RUN.id))
    return exists(select(later.c.id).where(later.c.measurement_sha256 == _RUN.measurement_sha256, newer))


def chosen(question: Select[Any], selection: Selection) -> Select[Any]:
    """A question for runs, or for their calibrations, narrowed to those that were chosen."""
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
    columns, found = schema.parameter.c, dict[int, dict[str, Parameter]]()
    for start in range(0, len(numbers), _MANY):
        some = numbers[start : start + _MANY]
        for row in connection.execute(select(schema.parameter).where(columns.calibration_id.in_(some))):
            number, name, *values = row
            found.setdefault(number, {})[name] = Parameter(name, *values)
    order = _order()
    places = {name: place for place, name in enumerate(order)}

    def place_of(parameter: tuple[str, Parameter]) -> tuple[int, str]:
        return places.get(parameter[0], len(order)), parameter[0]

    return {number: dict(sorted(each.items(), key=place_of)) for number, each in found.items()}


def _order() -> list[str]:
    """The parameters in the order in which they stand; one that is none of them comes last."""
    beside = (name for each in every_characteristic() for name in each.parameters)
    return list(dict.fromkeys([*SCALES, *BIASES, *beside]))
