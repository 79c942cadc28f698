"""The tables of a history. Rows are only added, never changed, as the modules `triggers` and `journal` ensure.

`run.result` is the complete `result.json`. The tables of calibrations and parameters, and most other columns of a run,
repeat values of it so that queries can find them.
"""

from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

VERSION = 1
APPLICATION_ID = 0x52494748  # "RIGH", at bytes 68 to 71 of a file (SQLite's file format, 1.3.13)
HASH, TIME, NAME, NOTE = 64, 40, 400, 1000  # longest texts of their kind

metadata = MetaData()


def number_column() -> Column[int]:
    """Return the id column: numbers from 1 without gaps, assigned by `next_number`.

    The database does not assign the numbers, because PostgreSQL's sequences leave a gap after a rollback.
    """
    return Column("id", Integer, primary_key=True, autoincrement=False)


def fill_row(table: Table, record: object, **stated: object) -> dict[str, Any]:
    """Return a row of the table: the `stated` values, and for every other column the record's attribute of that name.

    Raise AttributeError if the record lacks the attribute, because an empty column would remain unnoticed.
    """
    return {name: stated[name] if name in stated else getattr(record, name) for name in table.c.keys()}  # noqa: SIM118


meta = Table("meta", metadata, Column("key", String(40), primary_key=True), Column("value", String(NAME)))

# `measurement_sha256` is the same for results of the same recordings: a recomputed result, or one of a resumed run,
# replaces the earlier one in series.
run = Table(
    "run",
    metadata,
    number_column(),
    Column("content_sha256", String(HASH), nullable=False, unique=True),
    Column("measurement_sha256", String(HASH), nullable=False, index=True),
    Column("started_utc", String(TIME), nullable=False, index=True),
    Column("solved_utc", String(TIME), nullable=False),
    Column("entered_utc", String(TIME), nullable=False),
    Column("rig", String(NAME), nullable=False),
    Column("arm_serial_number", String(NAME), nullable=False),
    Column("board_unique_id", String(NAME), nullable=False),
    Column("configuration_sha256", String(HASH), nullable=False),
    Column("verdict", String(10), nullable=False),
    Column("fit", Boolean, nullable=False),  # whether the measurement passed its own checks
    Column("simulated", Boolean, nullable=False),
    Column("result", Text, nullable=False),
    Column("operator", String(NAME)),  # null if the configuration does not state it, as for the note
    Column("note", String(NOTE)),
)

location = Table(
    "location",
    metadata,
    number_column(),
    Column("run_id", ForeignKey("run.id"), nullable=False),
    Column("computer", String(NAME), nullable=False),
    Column("path", String(4096), nullable=False),
    Column("noted_utc", String(TIME), nullable=False),
    UniqueConstraint("run_id", "computer", "path"),
)

recording = Table(
    "recording",
    metadata,
    Column("run_id", ForeignKey("run.id"), primary_key=True),
    Column("name", String(NAME), primary_key=True),
    Column("bytes", BigInteger, nullable=False),
    Column("sha256", String(HASH), nullable=False),
)

calibration = Table(
    "calibration",
    metadata,
    number_column(),
    Column("run_id", ForeignKey("run.id"), nullable=False),
    Column("sensor", String(NAME), nullable=False),
    Column("quantity", String(40), nullable=False),
    Column("part", String(NAME), nullable=False),
    Column("serial_number", String(NAME), nullable=False),
    Column("full_scale", Float, nullable=False),
    Column("estimator", String(NAME), nullable=False),
    Column("temperature_c", Float),
    Column("check_standard", Boolean, nullable=False),
    UniqueConstraint("run_id", "sensor", "quantity"),
    Index("calibration_of_serial_number", "serial_number", "part"),
)

parameter = Table(
    "parameter",
    metadata,
    Column("calibration_id", ForeignKey("calibration.id"), primary_key=True),
    Column("name", String(40), primary_key=True),
    Column("value", Float, nullable=False),
    Column("std_statistical", Float, nullable=False),
    Column("std_combined", Float),  # null if only the noise is known
    Column("unit", String(40), nullable=False),
    Column("max_deviation", Float),  # deviation from the nominal value, by the limits of that run
    Column("coverage_factor", Float, nullable=False),  # coverage factor of U
)

# A wrong entry is not removed but marked as wrong, with the reason.
voided = Table(
    "voided",
    metadata,
    Column("calibration_id", ForeignKey("calibration.id"), primary_key=True),
    Column("reason", String(NOTE), nullable=False),
    Column("voided_utc", String(TIME), nullable=False),
)

# A certificate by its number, which depends on its content; `replaces` is the number that it amends, of this history or
# another. `marks` is the text across its pages, such as that the laboratory is simulated: a valid one has none.
certificate = Table(
    "certificate",
    metadata,
    number_column(),
    Column("number", String(40), nullable=False, unique=True),
    Column("run_id", ForeignKey("run.id"), nullable=False, index=True),
    Column("title", String(40), nullable=False),
    Column("issued", String(TIME), nullable=False),
    Column("replaces", String(NAME)),
    Column("marks", String(NOTE), nullable=False),
    Column("entered_utc", String(TIME), nullable=False),
)

# The files of a certificate, in a table of their own: a PDF made later adds a row and changes none.
certificate_file = Table(
    "certificate_file",
    metadata,
    Column("certificate_id", ForeignKey("certificate.id"), primary_key=True),
    Column("name", String(NAME), primary_key=True),
    Column("sha256", String(HASH), primary_key=True),
    Column("entered_utc", String(TIME), nullable=False),
)

# Other files of the run folder at the time of entry; for result.json the hash of its content.
document = Table(
    "document",
    metadata,
    Column("run_id", ForeignKey("run.id"), primary_key=True),
    Column("name", String(NAME), primary_key=True),
    Column("sha256", String(HASH), nullable=False),
)

# One line for each entry, numbered without gaps, with the hash of the entry's rows.
journal = Table(
    "journal",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("kind", String(40), nullable=False),  # the name of the table
    Column("key", String(1000), nullable=False),  # the row's primary key, as JSON
    Column("sha256", String(HASH), nullable=False),
    Column("entered_utc", String(TIME), nullable=False),
    # Hash of this line and of the line before, and so of all earlier lines.
    Column("chain_sha256", String(HASH), nullable=False),
    UniqueConstraint("kind", "key"),
)
