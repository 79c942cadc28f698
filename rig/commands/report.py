"""`rig report`: the documents of a finished run once more, in other forms or with the customer's name in them."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_set
from rig.commands.named_history import add_history, named_history
from rig.config.written_file import write_new
from rig.errors import Refused
from rig.station.plain_text import say, say_on_terminal


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig report`."""
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder or its result.json")
    parser.add_argument(
        "--pdf",
        action="store_true",
        help="PDF/A-3b too, with result.json and the digital certificate attached (extra `pdf`)",
    )
    parser.add_argument(
        "--reversal", type=Path, metavar="FILE", help="what `rig reversal … --out FILE` has found of its magnetometers"
    )
    parser.add_argument("--dcc", action="store_true", help="the digital certificate (DCC 3.2.1, XML) too")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to (default: the run folder)")
    add_history(parser)
    add_set(parser, "say something else on the certificate, for example certificate.customer=Example")


def run(options: Namespace) -> int:
    """Write the certificate as `documents` does; returns 0, or 2 where a form that was asked for could not be made."""
    _, left_out = documents(options)
    for error in left_out:
        say(f"rig: left out: {error}", sys.stderr)
    return Refused.exit_status if left_out else 0


def documents(options: Namespace) -> tuple[list[Path], list[Refused]]:
    """Certificate of a run folder or its result.json: HTML, and with `--dcc` and `--pdf` in these forms, into `--out`.

    `--reversal` is what `rig reversal` wrote of its magnetometers; `--history` where it is noted, the user's own
    history by default, and never one that the folder names. Returns the files, and why forms that were asked for could
    not be made. Raises Refused `report_folder`, and as `read_result`, `read_reversal`, `refuse_links`, `certificate_of`
    and `stated_in`.
    """
    from rig.commands.remember import remember_certificate
    from rig.data.magnetometer_entries import read_reversal
    from rig.data.result_file import read_result
    from rig.data.run_folder import RESULT, refuse_links
    from rig.history.issued import issued_certificate
    from rig.report.certificate.content import certificate_of
    from rig.report.certificate.dcc import DCC, digital_certificate
    from rig.report.certificate.page import certificate_page
    from rig.report.certificate.stated import stated_in
    from rig.report.certificate.writer import PAGE

    file: Path = options.run / RESULT if options.run.is_dir() else options.run
    result = read_result(file)
    turned = {} if options.reversal is None else read_reversal(options.reversal).magnetometers
    certificate = certificate_of(result, stated_in(file.parent, options.overrides), turned)
    written: dict[str, bytes] = {PAGE: certificate_page(certificate).encode()}
    left_out: list[Refused] = []
    digital: dict[str, bytes] = {}
    if options.dcc or options.pdf:
        try:
            digital = {DCC: digital_certificate(certificate)}
        except Refused as error:
            if options.dcc:
                left_out.append(error)
            else:
                say(f"rig: no digital certificate is attached: {error.what}", sys.stderr)
    if options.dcc:
        written |= digital
    folder: Path = options.out or file.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        refuse_links(*(folder / name for name in written))
        for name, content in written.items():
            write_new(folder / name, content)
        if options.pdf:
            from rig.report.certificate.pdf import PDF, pdf_of

            refuse_links(folder / PDF)
            say_on_terminal("drawing the PDF")
            try:
                written[PDF] = pdf_of(written[PAGE].decode(), {RESULT: file.read_bytes(), **digital})
                write_new(folder / PDF, written[PDF])
            except Refused as error:
                left_out.append(error)
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    for name in written:
        say(str(folder / name))
    issued = issued_certificate(certificate, written)
    missed = remember_certificate(file.parent, file.read_text(encoding="utf-8"), issued, named_history(options.history))
    if missed is not None:
        say(f"rig: the certificate is in no history: {missed}", sys.stderr)
    return [folder / name for name in written], left_out
