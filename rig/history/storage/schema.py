"""The tables of a history. Rows are only ever added: what was entered stays as it was (`triggers`, `journal`).

`run.result` is the whole `result.json`; every other column of a run, its calibrations and parameters is an index of it.
"""

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


def numbered() -> Column[int]:
    """Make a column of numbers from 1 on without gaps, which whoever enters a row counts up (`numbers`).

    Not the database: what PostgreSQL's sequences hand out to a transaction that ends without its rows is a gap.
    """
    return Column("id", Integer, primary_key=True, autoincrement=False)


meta = Table("meta", metadata, Column("key", String(40), primary_key=True), Column("value", String(NAME)))

# `measurement_sha256` is the same for results of the same recordings: one that was computed again, or of a run that was
# resumed, takes the place of the earlier one wherever series are made.
run = Table(
    "run",
    metadata,
    numbered(),
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
    Column("operator", String(NAME)),  # null if the configuration does not name one; so is the note
    Column("note", String(NOTE)),
)

location = Table(
    "location",
    metadata,
    numbered(),
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
    numbered(),
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
    Column("std_combined", Float),  # null where no more than noise is known
    Column("unit", String(40), nullable=False),
    Column("max_deviation", Float),  # from the nominal value, by the limits of that run
    Column("coverage_factor", Float, nullable=False),  # of U
)

# A wrong entry is not taken away: it is said that it is wrong, and why.
voided = Table(
    "voided",
    metadata,
    Column("calibration_id", ForeignKey("calibration.id"), primary_key=True),
    Column("reason", String(NOTE), nullable=False),
    Column("voided_utc", String(TIME), nullable=False),
)

# A certificate by its number, which another content does not have; `replaces` is the number it says it
# amends, of this history or another. `marks` is what stands across its pages, such as that the laboratory is simulated:
# only one without any is a certificate to rely on.
certificate = Table(
    "certificate",
    metadata,
    numbered(),
    Column("number", String(40), nullable=False, unique=True),
    Column("run_id", ForeignKey("run.id"), nullable=False, index=True),
    Column("title", String(40), nullable=False),
    Column("issued", String(TIME), nullable=False),
    Column("replaces", String(NAME)),
    Column("marks", String(NOTE), nullable=False),
    Column("entered_utc", String(TIME), nullable=False),
)

# The files it was written to. A table of their own: a PDF that is made later adds a row, and changes none.
certificate_file = Table(
    "certificate_file",
    metadata,
    Column("certificate_id", ForeignKey("certificate.id"), primary_key=True),
    Column("name", String(NAME), primary_key=True),
    Column("sha256", String(HASH), primary_key=True),
    Column("entered_utc", String(TIME), nullable=False),
)

# What lay beside the recordings when the run was entered; of result.json the hash of what it says.
document = Table(
    "document",
    metadata,
    Column("run_id", ForeignKey("run.id"), primary_key=True),
    Column("name", String(NAME), primary_key=True),
    Column("sha256", String(HASH), nullable=False),
)

# Every entry a second time, as the hash of its rows, numbered without gaps.
journal = Table(
    "journal",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("kind", String(40), nullable=False),  # the table
    Column("key", String(1000), nullable=False),  # what finds the row there, as JSON
    Column("sha256", String(HASH), nullable=False),
    Column("entered_utc", String(TIME), nullable=False),
    Column("chain_sha256", String(HASH), nullable=False),  # of this line and, through the one before it, of all before
    UniqueConstraint("kind", "key"),
)
