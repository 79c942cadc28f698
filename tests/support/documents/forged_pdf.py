"""Forgeries of a signed PDF: ways to change its message under the existing signature."""

import io
from collections.abc import Callable, Sequence
from typing import Any

from pyhanko.pdf_utils.generic import (
    ArrayObject,
    DictionaryObject,
    NameObject,
    NullObject,
    NumberObject,
    StreamObject,
    TextStringObject,
    pdf_name,
)
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.signers import PdfSignatureMetadata, sign_pdf

from support.documents.forging_cms import (
    Forgery,
    add_unsigned,
    certificate_added,
    certificate_altered,
    change_container,
    change_stamp,
    digests_more,
    lists_added,
    parameters_more,
    server_altered,
    signer_doubled,
    stamp_by_stranger,
    stamp_doubled,
)
from support.documents.signing import holder, signing_as


def replace(old: bytes, new: bytes) -> Forgery:
    def forge(content: bytes) -> bytes:
        assert old in content
        return content.replace(old, new, 1)

    return forge


def flip(pattern: bytes, further: int) -> Forgery:
    """Flip one bit, `further` bytes behind the first `pattern`."""

    def forge(content: bytes) -> bytes:
        data = bytearray(content)
        data[content.index(pattern) + further] ^= 1
        return bytes(data)

    return forge


def hex_changed(content: bytes, offset: int) -> bytes:
    digit = b"0" if content[offset : offset + 1] != b"0" else b"1"
    return content[:offset] + digit + content[offset + 1 :]


def signature_changed(content: bytes) -> bytes:
    """Change the signature's value, which lies among certificates and a time stamp."""
    (signature,) = PdfFileReader(io.BytesIO(content)).embedded_signatures
    value = signature.signer_info["signature"].native.hex().encode()
    return hex_changed(content, content.lower().index(value) + 20)


def padding_changed(content: bytes) -> bytes:
    return hex_changed(content, content.index(b">", content.index(b"/Contents <")) - 2)


def remove_signature(content: bytes) -> bytes:
    return content[: content.index(b"%%EOF") + 6]


def update(change: Callable[[IncrementalPdfFileWriter], object]) -> Forgery:
    """Make an incremental update, as an editor does."""

    def forge(content: bytes) -> bytes:
        writer = IncrementalPdfFileWriter(io.BytesIO(content))
        change(writer)
        writer.update_root()
        out = io.BytesIO()
        writer.write(out)
        return out.getvalue()

    return forge


def page_of(writer: IncrementalPdfFileWriter) -> Any:
    page = writer.root["/Pages"]["/Kids"][0]
    writer.mark_update(page.container_ref)
    return page


def other_page(writer: IncrementalPdfFileWriter) -> None:
    shown = b"BT /F1 24 Tf 50 700 Td (k = 1 1 1) Tj ET"
    page_of(writer)[pdf_name("/Contents")] = writer.add_object(StreamObject(stream_data=shown))


def no_page(writer: IncrementalPdfFileWriter) -> None:
    pages = writer.root["/Pages"]
    del pages["/Kids"][-1]
    pages[pdf_name("/Count")] = NumberObject(len(pages["/Kids"]))
    writer.mark_update(pages.container_ref)


def note(writer: IncrementalPdfFileWriter) -> None:
    """Put an annotation over the page, like a reader's comment."""
    box = ArrayObject(map(NumberObject, (0, 0, 500, 800)))
    names = {"/Type": "/Annot", "/Subtype": "/FreeText"}
    annotation = DictionaryObject({pdf_name(key): NameObject(value) for key, value in names.items()})
    annotation[pdf_name("/Rect")], annotation[pdf_name("/Contents")] = box, TextStringObject("k = 1 1 1")
    page_of(writer)[pdf_name("/Annots")] = ArrayObject([writer.add_object(annotation)])


def attachments(writer: IncrementalPdfFileWriter) -> Any:
    return writer.root["/Names"]["/EmbeddedFiles"]["/Names"]


def other_attachment(writer: IncrementalPdfFileWriter) -> None:
    stream = writer.add_object(StreamObject(stream_data=b'{"verdict": "pass"}'))
    file = attachments(writer)[1]
    file["/EF"][pdf_name("/F")] = file["/EF"][pdf_name("/UF")] = stream
    writer.mark_update(file.container_ref)


def script(writer: IncrementalPdfFileWriter) -> None:
    action = {pdf_name("/S"): NameObject("/JavaScript"), pdf_name("/JS"): TextStringObject("app.alert('pass')")}
    writer.root[pdf_name("/OpenAction")] = DictionaryObject(action)


def signature_object(change: Callable[[Any], object]) -> Callable[[IncrementalPdfFileWriter], None]:
    def update(writer: IncrementalPdfFileWriter) -> None:
        field = writer.root["/AcroForm"]["/Fields"][0]
        change(field["/V"])
        writer.mark_update(field["/V"].container_ref)

    return update


def remove_certification(writer: IncrementalPdfFileWriter) -> None:
    """Replace a page, and remove the rule that forbids it."""
    other_page(writer)
    del writer.root["/Perms"]


def sign_again(content: bytes) -> bytes:
    """Sign a changed page a second time, by a stranger."""
    by = signing_as(holder("Laboratory", holder("Authority")))
    about = PdfSignatureMetadata(field_name="Other", md_algorithm="sha256")
    writer = IncrementalPdfFileWriter(io.BytesIO(update(remove_certification)(content)))
    return bytes(sign_pdf(writer, about, by.signer).getbuffer())


def change_range(change: Callable[[list[int], int], Sequence[int]]) -> Forgery:
    """Change the signed byte range."""

    def forge(content: bytes) -> bytes:
        begin = content.index(b"/ByteRange [")
        end = content.index(b"]", begin) + 1
        numbers = list(map(int, content[begin + 12 : end - 1].split()))
        numbers_text = " ".join(map(str, change(numbers, len(content))))
        return content[:begin] + f"/ByteRange [{numbers_text}]".encode().ljust(end - begin) + content[end:]

    return forge


def move_end(content: bytes) -> bytes:
    """Move the signed end back and insert content (signature wrapping)."""
    inserted = b"\n9 0 obj\n(k = 1 1 1)\nendobj\n"
    forged = change_range(lambda numbers, _: [*numbers[:2], numbers[2] + len(inserted), numbers[3]])(content)
    offset = content.index(b">", content.index(b"/Contents <")) + 1
    return forged[:offset] + inserted + forged[offset:]


def mix_case(content: bytes) -> bytes:
    offset = content.index(b"/Contents <") + 11
    return content[:offset] + content[offset : offset + 40].swapcase() + content[offset + 40 :]


def _none(node: Any, key: str) -> None:
    node[pdf_name(key)] = NullObject()


def _remove(node: Any, key: str) -> None:
    del node[key]


def _language(writer: IncrementalPdfFileWriter) -> None:
    writer.root[pdf_name("/Lang")] = TextStringObject("de")


def _form(writer: IncrementalPdfFileWriter) -> None:
    writer.root[pdf_name("/AcroForm")] = DictionaryObject({pdf_name("/Fields"): ArrayObject([])})


FORGED_PDF: dict[str, Forgery] = {
    # Bytes that are signed.
    "a byte of a page": flip(b"stream\n", 40),
    "a byte of an attachment": flip(b"/EmbeddedFile", 120),
    "the version": replace(b"%PDF-1.7", b"%PDF-1.6"),
    "the reason": replace(b"(Simulated", b"(Different"),
    "the day": replace(rb"/M (D\07220", rb"/M (D\07219"),
    "which files are attached": replace(b"/EmbeddedFiles", b"/EmbeddedFilez"),
    # What is signed of it.
    "a range that begins later": change_range(lambda numbers, _: [1, *numbers[1:]]),
    "a range that ends earlier": change_range(lambda numbers, _: [*numbers[:3], numbers[3] - 10]),
    "a range with a wider gap": change_range(lambda numbers, _: [numbers[0], numbers[1] - 10, *numbers[2:]]),
    "a range of six": change_range(lambda numbers, _: [0, 9, 9, numbers[1] - 9, *numbers[2:]]),
    "an end moved back": move_end,
    "letters of the signature": mix_case,
    "its signature": signature_changed,
    "what follows its signature": padding_changed,
    # What comes before or after.
    "bytes at its end": lambda content: content + b"\n% better\n",
    "its end": lambda content: content[:-40],
    "an update by an editor": update(_language),
    "a page replaced by an update": update(other_page),
    "a page removed by an update": update(no_page),
    "a note over a page": update(note),
    "an attachment replaced by an update": update(other_attachment),
    "a script that runs at once": update(script),
    "a signature without contents": update(signature_object(lambda found: _remove(found, "/Contents"))),
    "a signature with no contents": update(signature_object(lambda found: _none(found, "/Contents"))),
    "a signature without a range": update(signature_object(lambda found: _remove(found, "/ByteRange"))),
    "a signature with no range": update(signature_object(lambda found: _none(found, "/ByteRange"))),
    "a second signature over another page": sign_again,
    # What the signature's container holds.
    "another certificate beside": certificate_added(lambda: holder("PTB")),
    "another certificate of the time server": change_container(change_stamp(server_altered)),
    "lists of somebody": change_container(lists_added),
    "a time that is not signed": change_container(add_unsigned),
    "two time stamps": change_container(stamp_doubled),
    "two signers": change_container(signer_doubled),
    "another digest beside": change_container(digests_more),
    "a text in the method": change_container(parameters_more),
    "a text in the time stamp": change_container(change_stamp(add_unsigned)),
    "lists in the time stamp": change_container(change_stamp(lists_added)),
}
# By whom it is: nothing is altered that is signed.
UNTRUSTED_PDF: dict[str, tuple[Forgery, str]] = {
    "all but the signature": (remove_signature, "not_signed"),
    "another document at its end": (lambda content: content + remove_signature(content), "not_signed"),
    "no field for a signature": (update(_form), "not_signed"),
    "something before it": (lambda content: b"% better\n" + content, "not_signed"),
    "a certificate of the authority altered": (change_container(certificate_altered), "signer_not_trusted"),
    "a time stamp by a stranger": (change_container(stamp_by_stranger), "signer_not_trusted"),
}
