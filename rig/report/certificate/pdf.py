"""The certificate as PDF/A-3b: the page of `certificate.html`, with its source data attached."""

from collections.abc import Mapping

from firmware_host.installation import install_command
from rig.errors import Refused

PDF = "certificate.pdf"
DESCRIPTIONS = {"result.json": "the result, of schema rig.result/1", "certificate.xml": "the digital certificate (DCC)"}


def pdf_of(page: str, attachments: Mapping[str, bytes]) -> bytes:
    """Return the page as PDF with the attached files, which `attachments` gives by name.

    Raise Refused `no_weasyprint` if the extra `pdf` or a library that it needs is not installed.
    """
    try:
        from weasyprint import HTML, Attachment
    except (ImportError, OSError) as error:  # OSError: Pango itself is missing
        raise Refused(
            "no_weasyprint",
            f"WeasyPrint, which makes the PDF, cannot be loaded ({str(error).splitlines()[0]})",
            f"Install it: {install_command('pdf')}, and Pango (Debian: libpangoft2-1.0-0), or print certificate.html",
        ) from None
    enclosed = [
        Attachment(string=content, name=name, description=DESCRIPTIONS[name], relationship="Source")
        for name, content in attachments.items()
    ]
    content = HTML(string=page).write_pdf(pdf_variant="pdf/a-3b", attachments=enclosed)
    assert content is not None, "only with a target it returns nothing"
    return content
