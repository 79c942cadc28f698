"""`rig report`: the documents of a finished run once more, in other forms or with the customer's name in them."""

import sys
from collections.abc import Sequence
from pathlib import Path

from rig.data.magnetometer_entries import read_reversal
from rig.data.result_file import read_result
from rig.data.run_folder import RESULT
from rig.errors import Refused
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
) -> int:
    """Certificate of a run folder or its result.json: HTML, and with `dcc` and `pdf` in these forms, into `out`.

    `reversal` is what `rig reversal` wrote of its magnetometers. Returns 0. Raises Refused as `read_result`,
    `read_reversal`, `certificate_of`, `stated_in`, `digital_certificate` and `write_pdf` do, `report_folder`.
    """
    file = run / RESULT if run.is_dir() else run
    result = read_result(file)
    turned = {} if reversal is None else read_reversal(reversal).magnetometers
    certificate = certificate_of(result, stated_in(file.parent, overrides), turned)
    documents = {PAGE: certificate_page(certificate).encode()}
    digital = _digital(certificate, wanted=dcc) if dcc or pdf else {}
    folder = out or file.parent
    written = [folder / name for name in (documents | digital if dcc else documents)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in written:
            path.write_bytes((documents | digital)[path.name])
        if pdf:
            from rig.report.certificate.pdf import write_pdf

            written.append(folder / "certificate.pdf")
            write_pdf(documents[PAGE].decode(), {RESULT: file.read_bytes(), **digital}, written[-1])
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    for path in written:
        say(str(path))
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
