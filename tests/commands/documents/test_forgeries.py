"""Forged certificates: what stands in a file and is not signed is refused, and so is who may not sign documents."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, ObjectIdentifier
from lxml import etree
from pyhanko.pdf_utils.generic import StreamObject
from pyhanko.pdf_utils.writer import PageObject, PdfFileWriter

from rig.report.signatures.inspection import PDF_MAX_BYTES, XML_MAX_BYTES
from rig.report.signatures.reason import Reason
from rig.report.signatures.signing import sign_as_pades, sign_as_xades
from support.documents.forged_json import FORGED_JSON, IN_OTHER_BYTES
from support.documents.forged_pdf import FORGED_PDF, UNTRUSTED_PDF
from support.documents.forged_xml import FORGED_XML, MOVED_XML
from support.documents.forging_xml import DCC, DS, better_results
from support.documents.signed_laboratory import PDF, RESULT, XML, Laboratory, names_of
from support.documents.signing import Holder, holder, issue, signing_as

# WeasyPrint does not close its colour profile.
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:.*sRGB2014.icc:pytest.PytestUnraisableExceptionWarning"),
]
ALTERED, NOBODY_TRUSTED = 1, 4


@pytest.fixture
def lab(made: Laboratory, tmp_path: Path) -> Laboratory:
    return made.copied(tmp_path)


def refused(lab: Laboratory, file: str, forge: Callable[[bytes], bytes], *beside: str, history: bool = False) -> str:
    """The names of what is wrong with a file when it is forged, and the exit status."""
    before = lab.read(file)
    (lab.folder / file).write_bytes(forge(before))
    assert lab.read(file) != before
    status, said = lab.verified(*beside, file, history=history)
    return f"{status} {' '.join(sorted(set(names_of(said))))}"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("what", FORGED_XML)
def test_a_digital_certificate_in_which_something_is_not_signed_is_refused(what: str, lab: Laboratory) -> None:
    assert refused(lab, XML, FORGED_XML[what]) == f"{ALTERED} not_as_signed"


@pytest.mark.parametrize("what", MOVED_XML)
def test_a_digital_certificate_whose_signature_is_not_its_own_is_not_signed(what: str, lab: Laboratory) -> None:
    assert refused(lab, XML, MOVED_XML[what]) == f"{NOBODY_TRUSTED} not_signed"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("what", FORGED_PDF)
def test_a_pdf_in_which_something_is_not_signed_is_refused(what: str, lab: Laboratory) -> None:
    assert refused(lab, PDF, FORGED_PDF[what]) == f"{ALTERED} not_as_signed"


@pytest.mark.parametrize("what", UNTRUSTED_PDF)
def test_a_pdf_that_nobody_trusted_answers_for_is_refused(what: str, lab: Laboratory) -> None:
    forge, name = UNTRUSTED_PDF[what]
    assert refused(lab, PDF, forge) == f"{NOBODY_TRUSTED} {name}"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("what", FORGED_JSON | IN_OTHER_BYTES)
def test_a_result_that_is_not_to_the_byte_the_attached_one_is_refused(what: str, lab: Laboratory) -> None:
    assert refused(lab, RESULT, (FORGED_JSON | IN_OTHER_BYTES)[what], PDF) == f"{ALTERED} not_as_signed"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("what", FORGED_JSON)
def test_a_history_knows_a_result_by_each_of_its_values(what: str, lab: Laboratory) -> None:
    assert refused(lab, RESULT, FORGED_JSON[what], history=True) == f"{ALTERED} not_signed unknown_to_history"


def text_of(content: bytes) -> str:
    return bytes(etree.tostring(etree.fromstring(content), encoding="UTF-8")).decode()


@pytest.mark.parametrize(
    "written",
    [
        lambda content: text_of(content).encode(),
        lambda content: b"\xef\xbb\xbf" + content,
        lambda content: b'<?xml version="1.0" encoding="UTF-8" standalone="no"?>' + text_of(content).encode(),
        lambda content: f'<?xml version="1.0" encoding="UTF-16"?>{text_of(content)}'.encode("utf-16"),
        lambda content: text_of(content).encode("utf-16"),
        lambda content: f'<?xml version="1.0" encoding="UTF-16BE"?>{text_of(content)}'.encode("utf-16-be"),
    ],
    ids=["no declaration", "byte order", "standalone", "UTF-16", "UTF-16, no declaration", "UTF-16BE"],
)
def test_a_signed_digital_certificate_is_read_in_every_usual_encoding(
    written: Callable[[bytes], bytes], lab: Laboratory
) -> None:
    (lab.folder / XML).write_bytes(written(lab.read(XML)))
    assert lab.verified(XML, history=False)[0] == 0


@pytest.mark.parametrize(("file", "limit"), [(PDF, PDF_MAX_BYTES), (XML, XML_MAX_BYTES)])
def test_a_file_that_is_too_long_for_a_certificate_is_not_parsed(file: str, limit: int, lab: Laboratory) -> None:
    (lab.folder / file).write_bytes(lab.read(file) + b" " * limit)
    status, said = lab.verified(file, history=False)
    assert (status, names_of(said)) == (ALTERED, ["not_as_signed"]) and f"longer than {limit} bytes" in said


def key() -> ec.EllipticCurvePrivateKey:
    return ec.generate_private_key(ec.SECP256R1())


ServerAuth, ClientAuth = ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH
DOCUMENTS, MAIL = ObjectIdentifier("1.3.6.1.5.5.7.3.36"), ExtendedKeyUsageOID.EMAIL_PROTECTION
# Who is certified by the trusted authority and may not sign documents, or is not the one that is expected.
OTHERS: dict[str, Callable[[Holder], Holder]] = {
    "a web server": lambda of: issue("Laboratory", key(), of, purposes=[ServerAuth]),
    "a web server and client": lambda of: issue("Laboratory", key(), of, purposes=[ServerAuth, ClientAuth]),
    "a maker of programs": lambda of: issue("Laboratory", key(), of, purposes=[ExtendedKeyUsageOID.CODE_SIGNING]),
    "a time server": lambda of: issue("Laboratory", key(), of, purposes=[ExtendedKeyUsageOID.TIME_STAMPING]),
    "a key to encrypt with": lambda of: issue("Laboratory", key(), of, usage=["key_encipherment"]),
    "a key to agree with": lambda of: issue("Laboratory", key(), of, usage=["key_agreement"], purposes=[MAIL]),
    "a key without a usage": lambda of: issue("Laboratory", key(), of, usage=[]),
    "a weak key": lambda of: issue("Laboratory", rsa.generate_private_key(65537, 1024), of),
    "a short key": lambda of: issue("Laboratory", ec.generate_private_key(ec.SECP224R1()), of),
    "an authority": lambda of: of,
    "one that has expired": lambda of: issue("Laboratory", key(), of, days=(-9, -2)),
    "one that is to come": lambda of: issue("Laboratory", key(), of, days=(2, 9)),
    "somebody below a signer": lambda of: issue("Laboratory", key(), issue("Signer", key(), of)),
    "another name": lambda of: issue("Laboratory 2", key(), of),
    "a stranger of that name": lambda of: issue("Laboratory", key(), holder("Authority")),
    "oneself": lambda of: issue("Laboratory", key(), usage=["digital_signature"]),
}


def empty_pdf() -> bytes:
    writer = PdfFileWriter()
    writer.insert_page(PageObject(contents=writer.add_object(StreamObject(stream_data=b"q Q")), media_box=(0, 0, 9, 9)))
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def signed_by(lab: Laboratory, by: Holder) -> None:
    """Both files anew, as another signs them."""
    root = etree.fromstring(lab.read(XML))
    root.remove(root.find(f"{DS}Signature"))
    (lab.folder / XML).write_bytes(sign_as_xades(etree.tostring(root), signing_as(by), Reason("A test")))
    (lab.folder / PDF).write_bytes(sign_as_pades(empty_pdf(), signing_as(by), Reason("A test")))


@pytest.mark.one_in(2)
@pytest.mark.parametrize("file", [PDF, XML])
@pytest.mark.parametrize("who", OTHERS)
def test_whoever_may_not_sign_documents_or_is_another_is_not_trusted(who: str, file: str, lab: Laboratory) -> None:
    signed_by(lab, OTHERS[who](lab.authority))
    status, said = lab.verified(file, history=False, signer="Laboratory")
    assert (status, names_of(said)) == (NOBODY_TRUSTED, ["signer_not_trusted"]), said


@pytest.mark.parametrize("purposes", [(), (DOCUMENTS,), (ServerAuth, MAIL)], ids=["none", "documents", "mail too"])
def test_a_certificate_for_documents_is_trusted_by_its_name_or_by_all_of_it(
    purposes: tuple[ObjectIdentifier, ...], lab: Laboratory
) -> None:
    signed_by(lab, issue("Laboratory", key(), lab.authority, usage=["content_commitment"], purposes=purposes))
    for name in (None, "Laboratory", "CN=Laboratory"):
        status, said = lab.verified(PDF, XML, history=False, signer=name)
        assert (status, names_of(said)) == (0, []), said
    assert lab.verified(PDF, history=False, signer="laboratory")[0] == NOBODY_TRUSTED


def test_a_self_signed_one_is_trusted_by_its_own_certificate_alone(lab: Laboratory, tmp_path: Path) -> None:
    by = OTHERS["oneself"](lab.authority)
    signed_by(lab, by)
    status, said = lab.verified(PDF, XML, history=False, trust=False)
    assert (status, names_of(said)) == (NOBODY_TRUSTED, ["signer_unknown"] * 2), said
    (tmp_path / "own.pem").write_bytes(by.certificates())
    assert replace(lab, root=tmp_path / "own.pem").verified(PDF, XML, history=False)[0] == 0


@pytest.mark.parametrize("change", ["other", "double"])
def test_what_is_signed_must_be_a_certificate_with_one_set_of_results(change: str, lab: Laboratory) -> None:
    root = etree.fromstring(lab.read(XML))
    root.remove(root.find(f"{DS}Signature"))
    if change == "double":
        root.insert(2, better_results(root))
    else:
        root.tag = f"{DCC}digitalCalibrationRequest"
    signed = sign_as_xades(etree.tostring(root), signing_as(lab.signer), Reason("A test"))
    (lab.folder / XML).write_bytes(signed)
    status, said = lab.verified(XML, history=False)
    assert (status, names_of(said)) == (ALTERED, ["not_as_signed"]) and "one set of results" in said
