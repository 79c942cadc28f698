"""`rig report`: the documents of a finished run again, in other forms or with the customer's name."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_history, add_run, add_set, read_history_name
from rig.commands.report_folder import refuse_unwritable
from rig.config.files.safe_writing import replace_together, write_new
from rig.errors import Refused
from rig.station.plain_text import say, say_on_terminal

if TYPE_CHECKING:
    from rig.report.certificate.content import Certificate
    from rig.report.signatures.reason import Reason
    from rig.report.signatures.signatory import Signatory


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig report`."""
    add_run(parser, "run", "a run folder or its result.json")
    parser.add_argument(
        "--pdf",
        action="store_true",
        help="also write PDF/A-3b, with result.json and the digital certificate attached (extra `pdf`)",
    )
    parser.add_argument(
        "--reversal",
        type=Path,
        metavar="FILE",
        help="file that `rig reversal --out` wrote for the run's magnetometers",
    )
    parser.add_argument("--dcc", action="store_true", help="also write the digital certificate (DCC 3.2.1, XML)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the documents (default: the run folder)")
    parser.add_argument(
        "--sign",
        metavar="KEY",
        help="sign the PDF (written if no form is chosen) and the digital certificate (extra `sign`): a PKCS#12 or PEM "
        "file, or pkcs11:token=…;object=…?module-path=…; its passphrase or PIN in RIG_SIGNING_PASSPHRASE",
    )
    parser.add_argument(
        "--time-server", metavar="URL", help="put a time stamp (RFC 3161) of this server in the PDF's signature"
    )
    parser.add_argument(
        "--long-term",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="add revocation lists to the PDF's signature (PAdES B-LT): the list (CRL) and the certificate, as PEM, "
        "of the authority of the key and of that of the time server; may be repeated",
    )
    add_history(parser)
    add_set(parser, "replace an entry on the certificate, for example certificate.customer=Example")


def run(options: Namespace) -> int:
    """Write the certificate as `write_documents` does; return 0, or 2 if a requested form could not be made."""
    _, left_out = write_documents(options)
    for error in left_out:
        say(f"rig: left out: {error}", sys.stderr)
    return Refused.exit_status if left_out else 0


def write_documents(options: Namespace) -> tuple[list[Path], list[Refused]]:
    """Write the certificate of a run folder or its result.json into `--out`: HTML, and XML and PDF on request.

    `--sign` is the key that signs XML and PDF, `--time-server` the server that dates the signature. `--reversal` is the
    file that `rig reversal` wrote for the run's magnetometers. `--history` is the history in which the certificate is
    entered, by default the user's own, never one that the folder names. Return the files, and why requested forms could
    not be made. Raise Refused `report_folder`, `bad_option`, and what `read_result`, `read_reversal`, `refuse_links`,
    `certificate_of`, `folder_statements` and `signatory` raise.
    """
    if options.sign is None and options.time_server is not None:
        raise Refused("bad_option", "--time-server is for signed documents", "Give --sign KEY too, or leave it out")
    if options.long_term and options.time_server is None:
        what = "--long-term shows revocations at the time of signing, which needs a time server"
        raise Refused("bad_option", what, "Give --sign KEY and --time-server URL too, or leave it out")
    if options.sign is None:
        return _write_signed(options, None)
    from rig.report.signatures.signatory import signatory

    with signatory(options.sign) as by:
        return _write_signed(options, by)


def _write_signed(options: Namespace, by: "Signatory | None") -> tuple[list[Path], list[Refused]]:
    """Write the certificate in every requested form and enter it in the history; return files and failures."""
    from rig.commands.history.remember import find_journal_end, remember_certificate
    from rig.data.entries.magnetometer import read_reversal
    from rig.data.result_file import read_result
    from rig.data.run_folder import CERTIFICATE, RESULT, refuse_links
    from rig.history.entered.issued_certificate import issue_certificate
    from rig.report.certificate.certificate_page import certificate_page
    from rig.report.certificate.content import certificate_of
    from rig.report.certificate.pdf import PDF
    from rig.report.certificate.statements import folder_statements
    from rig.report.signatures.reason import reason_of

    pdf = options.pdf or (by is not None and not options.dcc)  # the page itself cannot carry a signature
    file: Path = options.run / RESULT if options.run.is_dir() else options.run
    result = read_result(file)
    reversals = {} if options.reversal is None else read_reversal(options.reversal).magnetometers
    certificate = certificate_of(result, folder_statements(file.parent, options.overrides), reversals)
    end = None if by is None else find_journal_end(file.parent, read_history_name(options.history))
    reason = reason_of(certificate, end)
    written: dict[str, bytes] = {CERTIFICATE: certificate_page(certificate).encode()}
    left_out: list[Refused] = []
    digital = _make_digital(certificate, by, reason, left_out if options.dcc else None) if options.dcc or pdf else {}
    if options.dcc:
        written |= digital
    folder: Path = options.out or file.parent
    with refuse_unwritable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        refuse_links(*(folder / name for name in (*written, *([PDF] if pdf else []))))
        with replace_together():
            for name, content in written.items():
                write_new(folder / name, content)
            if pdf:
                say_on_terminal("drawing the PDF")
                try:
                    attached = {RESULT: file.read_bytes(), **digital}
                    written[PDF] = _make_pdf(written[CERTIFICATE].decode(), attached, by, reason, options)
                    write_new(folder / PDF, written[PDF])
                except Refused as error:
                    left_out.append(error)
    for name in written:
        say(str(folder / name))
    issued = issue_certificate(certificate, written)
    reason_not_noted = remember_certificate(
        file.parent, file.read_text(encoding="utf-8"), issued, read_history_name(options.history)
    )
    if reason_not_noted is not None:
        say(f"rig: the certificate is in no history: {reason_not_noted}", sys.stderr)
    return [folder / name for name in written], left_out


def _make_digital(
    certificate: "Certificate", by: "Signatory | None", reason: "Reason", left_out: list[Refused] | None
) -> dict[str, bytes]:
    """Return the digital certificate by its file name, signed if a signatory (`by`) is given.

    If it cannot be made, return no file; the error is appended to `left_out`, or printed if `left_out` is None.
    """
    from rig.report.certificate.dcc import DCC, digital_certificate

    try:
        certificate_xml = digital_certificate(certificate)
    except Refused as error:
        if left_out is None:
            say(f"rig: no digital certificate is attached: {error.what}", sys.stderr)
        else:
            left_out.append(error)
        return {}
    if by is None:
        return {DCC: certificate_xml}
    from rig.report.signatures.signing import sign_as_xades

    return {DCC: sign_as_xades(certificate_xml, by, reason)}


def _make_pdf(
    page: str, attached: Mapping[str, bytes], by: "Signatory | None", reason: "Reason", options: Namespace
) -> bytes:
    """Return the page as PDF, signed by a signatory. Raise as `pdf_of`, `read_authorities` and `sign_as_pades` do."""
    from rig.report.certificate.pdf import pdf_of

    document = pdf_of(page, attached)
    if by is None:
        return document
    from rig.report.signatures.long_term import read_authorities
    from rig.report.signatures.signing import sign_as_pades

    authorities = read_authorities(options.long_term) if options.long_term else None
    return sign_as_pades(document, by, reason, options.time_server, authorities)
