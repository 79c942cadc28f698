"""Certificates in a history: each number is entered once, and a run's certificates are read. The caller commits."""

from sqlalchemy import Connection, insert, select

from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.storage import journal
from rig.history.storage.row_numbers import next_number
from rig.history.storage.schema import certificate, certificate_file, fill_row


def enter(connection: Connection, run_id: int, issued: IssuedCertificate, now_utc: str) -> None:
    """Add the certificate and its new files; change no existing rows."""
    number = connection.scalar(select(certificate.c.id).where(certificate.c.number == issued.number))
    if number is None:
        number = next_number(connection, certificate)
        row = fill_row(certificate, issued, id=number, run_id=run_id, entered_utc=now_utc)
        connection.execute(insert(certificate).values(row))
        journal.note(connection, certificate, number)
    files = certificate_file.c
    existing = select(files.name, files.sha256).where(files.certificate_id == number)
    entered = {(row.name, row.sha256) for row in connection.execute(existing)}
    for name, sha256 in issued.files:
        if (name, sha256) not in entered:
            row = {"certificate_id": number, "name": name, "sha256": sha256, "entered_utc": now_utc}
            connection.execute(insert(certificate_file).values(row))
            journal.note(connection, certificate_file, number, name, sha256)


def select_run(connection: Connection, run_id: int) -> tuple[IssuedCertificate, ...]:
    """Return the certificates of a run, each with its files, in the order of entry."""
    query = select(certificate).where(certificate.c.run_id == run_id).order_by(certificate.c.id)
    return tuple(
        IssuedCertificate(row.number, row.title, row.issued, row.replaces, row.marks, _files(connection, row.id))
        for row in connection.execute(query).all()
    )


def _files(connection: Connection, number: int) -> tuple[tuple[str, str], ...]:
    files = certificate_file.c
    query = select(files.name, files.sha256).where(files.certificate_id == number)
    rows = connection.execute(query.order_by(files.entered_utc, files.name)).all()
    return tuple((row.name, row.sha256) for row in rows)
