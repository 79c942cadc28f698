"""`rig report`: the documents of a finished run once more, in other forms or with the customer's name in them."""

import sys
from collections.abc import Sequence
from pathlib import Path

from rig.commands.named_history import named_history
from rig.commands.remember import remember_certificate
from rig.config.written_file import write_new
from rig.data.magnetometer_entries import read_reversal
from rig.data.result_file import read_result
from rig.data.run_folder import RESULT, refuse_links
from rig.errors import Refused
from rig.history.issued import issued_certificate
from rig.report.certificate.content import Certificate, certificate_of
from rig.report.certificate.page import certificate_page
from rig.report.certificate.stated import stated_in
from rig.report.certificate.writer import PAGE
from rig.station.plain_text import say


def report(
    run: Path,
    out: Path | None,
    overrides: Sequence[str] = (),
    reversal: Path | None = None,
    *,
    pdf: bool = False,
    dcc: bool = False,
    history: str | None = None,
) -> int:
    """Certificate of a run folder or its result.json: HTML, and with `dcc` and `pdf` in these forms, into `out`.

    `reversal` is what `rig reversal` wrote of its magnetometers; `history` where it is noted, the user's own history by
    default, and never one that the folder names. Returns 0. Raises Refused `report_folder`, and as `read_result`,
    `read_reversal`, `refuse_links`, `certificate_of`, `stated_in`, `digital_certificate` and `pdf_of` do.
    """
    file = run / RESULT if run.is_dir() else run
    result = read_result(file)
    turned = {} if reversal is None else read_reversal(reversal).magnetometers
    certificate = certificate_of(result, stated_in(file.parent, overrides), turned)
    written: dict[str, bytes] = {PAGE: certificate_page(certificate).encode()}
    digital = _digital(certificate, wanted=dcc) if dcc or pdf else {}
    if dcc:
        written |= digital
    folder = out or file.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        refuse_links(*(folder / name for name in written))
        for name, content in written.items():
            write_new(folder / name, content)
        if pdf:
            from rig.report.certificate.pdf import PDF, pdf_of

            refuse_links(folder / PDF)
            written[PDF] = pdf_of(written[PAGE].decode(), {RESULT: file.read_bytes(), **digital})
            write_new(folder / PDF, written[PDF])
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    for name in written:
        say(str(folder / name))
    issued = issued_certificate(certificate, written)
    missed = remember_certificate(file.parent, file.read_text(encoding="utf-8"), issued, named_history(history))
    if missed is not None:
        say(f"rig: the certificate is in no history: {missed}", sys.stderr)
    return 0


def _digital(certificate: Certificate, *, wanted: bool) -> dict[str, bytes]:
    """The digital certificate by its file's name; one that is only to be attached may be missing, which is told."""
    from rig.report.certificate.dcc import DCC, digital_certificate

    try:
        return {DCC: digital_certificate(certificate)}
    except Refused as error:
        if wanted:
            raise
        say(f"rig: no digital certificate is attached: {error.what}", sys.stderr)
        return {}
