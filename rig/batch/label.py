"""The label of a part that passed: lines of text, the same for a label printer (ZPL), the certificate's number as QR.

ZPL II: Zebra, Programming Guide P1099957: `^FH` lets a field hold any byte as `_` and two hexadecimal digits, `^BQ`
prints a QR code. QR: ISO/IEC 18004, by the library segno.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors.extras import missing_extra

if TYPE_CHECKING:
    from segno import QRCode

DOTS = 8  # of a printer, each millimetre (203 dpi)
_PLAIN = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 .-:/")


@dataclass(frozen=True, slots=True)
class Label:
    """What stands on it: the part's `serial` number, the `day` it passed, its `certificate`'s number.

    `marks` are words that must not be missing beside them, such as that the laboratory is simulated.
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
    """The label's files by the endings of their names. Raises Refused `missing_extra`."""
    return {".txt": text(label).encode(), ".zpl": zpl(label).encode(), ".svg": qr_svg(label.certificate)}


def text(label: Label) -> str:
    """The label for any printer, with the QR code in half blocks. Raises Refused `missing_extra`."""
    from io import StringIO

    drawn = StringIO()
    _qr(label.certificate).terminal(drawn, compact=True, border=1)
    return "\n".join((*label.lines, "", drawn.getvalue()))


def zpl(label: Label) -> str:
    """The label for a printer that speaks ZPL II, 50 mm by 25 mm, at 203 dpi."""
    rows = (
        f"^FO{22 * DOTS},{(2 + 5 * number) * DOTS}^A0N,{3 * DOTS},{3 * DOTS}^FH^FD{_held(line)}^FS"
        for number, line in enumerate(label.lines)
    )
    code = f"^FO{DOTS},{DOTS}^BQN,2,4^FH^FDMA,{_held(label.certificate)}^FS"
    return "\n".join(("^XA", "^CI28", f"^PW{50 * DOTS}", f"^LL{25 * DOTS}", code, *rows, "^XZ", ""))


def qr_svg(content: str) -> bytes:
    """The QR code as a picture. Raises Refused `missing_extra`."""
    from io import BytesIO

    drawn = BytesIO()
    _qr(content).save(drawn, kind="svg", scale=4, xmldecl=False)
    return drawn.getvalue()


def refuse_without_library() -> None:
    """Raise Refused `missing_extra` before anything has moved, where labels could not be made."""
    _qr("")


def _qr(content: str) -> "QRCode":
    try:
        import segno
    except ImportError as error:
        raise missing_extra(error, "station") from error
    return segno.make(content or "RIG", error="m", micro=False)


def _held(words: str) -> str:
    return "".join(chr(each) if each in _PLAIN else f"_{each:02X}" for each in words.encode())
