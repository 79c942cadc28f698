"""The certificate as PDF/A-3b: the page of `certificate.html` with the data it was made from attached."""

from collections.abc import Mapping

from firmware_host.installation import install_command
from rig.errors import Refused

PDF = "certificate.pdf"
DESCRIBED = {"result.json": "the result, of schema rig.result/1", "certificate.xml": "the digital certificate (DCC)"}


def pdf_of(page: str, attachments: Mapping[str, bytes]) -> bytes:
    """`attachments` by name. Raises Refused `no_weasyprint` where the extra `pdf` or a library it needs is absent."""
    try:
        from weasyprint import HTML, Attachment
    except (ImportError, OSError) as error:  # OSError: Pango itself is not there
        raise Refused(
            "no_weasyprint",
            f"a PDF is made by WeasyPrint, which cannot be loaded ({str(error).splitlines()[0]})",
            f"Install it: {install_command('pdf')}, and Pango (Debian: libpangoft2-1.0-0), or print certificate.html",
        ) from None
    enclosed = [
        Attachment(string=content, name=name, description=DESCRIBED[name], relationship="Source")
        for name, content in attachments.items()
    ]
    made: bytes = HTML(string=page).write_pdf(pdf_variant="pdf/a-3b", attachments=enclosed)
    return made
