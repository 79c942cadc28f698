"""The label of a passed part: as text, for a label printer (ZPL), and with the certificate's number as QR code.

In ZPL II (Zebra, Programming Guide P1099957), `^FH` permits any byte in a field as `_` and two hexadecimal digits, and
`^BQ` prints a QR code. The library segno makes QR codes (ISO/IEC 18004).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors.extras import requiring

if TYPE_CHECKING:
    from segno import QRCode

DOTS = 8  # resolution of a printer, dots per millimetre (203 dpi)
_PLAIN = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 .-:/")


@dataclass(frozen=True, slots=True)
class Label:
    """The text of a label: the part's `serial` number, the `day` of its pass, its `certificate`'s number.

    `marks` are required warnings, for example that the laboratory is simulated.
    """

    serial: str
    day: str
    certificate: str
    marks: str = ""

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines of text."""
        return (self.serial, f"PASS {self.day}", self.certificate, *filter(None, [self.marks]))


def files_of(label: Label) -> Mapping[str, bytes]:
    """Return the contents of the label's files, by file name extension. Raise Refused `missing_extra`."""
    return {".txt": text(label).encode(), ".zpl": zpl(label).encode(), ".svg": qr_svg(label.certificate)}


def text(label: Label) -> str:
    """Return the label for any printer; half blocks form the QR code. Raise Refused `missing_extra`."""
    from io import StringIO

    drawn = StringIO()
    _qr(label.certificate).terminal(drawn, compact=True, border=1)
    return "\n".join((*label.lines, "", drawn.getvalue()))


def zpl(label: Label) -> str:
    """Return the label for a printer with ZPL II, 50 mm by 25 mm, at 203 dpi."""
    rows = (
        f"^FO{22 * DOTS},{(2 + 5 * number) * DOTS}^A0N,{3 * DOTS},{3 * DOTS}^FH^FD{_escape(line)}^FS"
        for number, line in enumerate(label.lines)
    )
    code = f"^FO{DOTS},{DOTS}^BQN,2,4^FH^FDMA,{_escape(label.certificate)}^FS"
    return "\n".join(("^XA", "^CI28", f"^PW{50 * DOTS}", f"^LL{25 * DOTS}", code, *rows, "^XZ", ""))


def qr_svg(content: str) -> bytes:
    """Return the QR code as a picture. Raise Refused `missing_extra`."""
    from io import BytesIO

    drawn = BytesIO()
    _qr(content).save(drawn, kind="svg", scale=4, xmldecl=False)
    return drawn.getvalue()


def refuse_without_library() -> None:
    """Raise Refused `missing_extra`, before anything moves, if labels cannot be made."""
    _qr("")


def _qr(content: str) -> "QRCode":
    with requiring("station"):
        import segno
    return segno.make(content or "RIG", error="m", micro=False)


def _escape(words: str) -> str:
    return "".join(chr(byte) if byte in _PLAIN else f"_{byte:02X}" for byte in words.encode())
