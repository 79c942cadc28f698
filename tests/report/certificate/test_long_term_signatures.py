"""A signature that can be checked when its certificate has expired: with the authorities' revocation lists under it."""

import io
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from asn1crypto.x509 import Certificate
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.generic import StreamObject
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.pdf_utils.writer import PageObject, PdfFileWriter
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko.sign.validation.dss import DocumentSecurityStore
from pyhanko_certvalidator import ValidationContext

from rig.errors import Refused
from rig.report.signatures.findings import FileInspection
from rig.report.signatures.inspection import PDF_MAX_BYTES, inspect_file
from rig.report.signatures.inspection_process import LARGE_BYTES, LIMITS, inspect_within_limits
from rig.report.signatures.long_term import read_authorities
from rig.report.signatures.reason import Reason
from rig.report.signatures.signatory import signatory
from rig.report.signatures.signing import sign_as_pades
from rig.report.signatures.trust import Trust
from support.documents.signing import PASSPHRASE, Holder, holder, revocation_list, stamping, time_server
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow  # to import what signs takes longer than the shortest of these tests


@dataclass(frozen=True)
class Signing:
    """A laboratory's key file, its authority, a time server of the same authority, and a folder for lists."""

    key: Path
    laboratory: Holder
    authority: Holder
    time_server: str
    folder: Path

    @property
    def trust(self) -> list[bytes]:
        return [self.authority.chain[0].public_bytes(Encoding.DER)]

    def signed(self, *lists: bytes, drawing: bytes = b"q Q") -> bytes:
        file = self.folder / "authority.pem"
        file.write_bytes(b"".join((*lists, self.authority.certificates())))
        with signatory(str(self.key)) as by:
            return sign_as_pades(page(drawing), by, Reason("A test"), self.time_server, read_authorities([file]))


@pytest.fixture
def signing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Signing]:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    authority = holder("Authority")
    laboratory = holder("Laboratory", authority)
    server = stamping("Time server", authority)
    with time_server(server) as url:
        yield Signing(laboratory.p12(tmp_path / "key.p12"), laboratory, authority, url, tmp_path)


def page(drawing: bytes = b"q Q") -> bytes:
    writer = PdfFileWriter()
    content = writer.add_object(StreamObject(stream_data=drawing))
    writer.insert_page(PageObject(contents=content, media_box=(0, 0, 200, 200)))
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def seen(pdf: bytes, trust: list[bytes]) -> FileInspection:
    return inspect_file("certificate.pdf", pdf, Trust(tuple(trust)))


def test_the_lists_are_signed_too_and_clear_the_signer_and_other_programs_agree(signing: Signing) -> None:
    made = signing.signed(revocation_list(signing.authority))
    looked = seen(made, signing.trust)
    (by,) = looked.signatures
    assert not looked.problems and by.long_term and by.time_server == "CN=Time server"
    (signing.folder / "made.pdf").write_bytes(made)
    told = subprocess.run(
        ["pdfsig", "-nocert", signing.folder / "made.pdf"],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    ).stdout
    assert "Signature is Valid" in told and "Total document signed" in told
    # pyHanko, which asks for lists of that time: what is in the file is enough, and without it nothing is.
    reader = PdfFileReader(io.BytesIO(made))
    asked: dict[str, Any] = {"trust_roots": list(map(Certificate.load, signing.trust)), "moment": by.when}
    asked |= {"revocation_mode": "require", "allow_fetching": False}
    with_lists = DocumentSecurityStore.read_dss(reader).as_validation_context(asked)
    for context, clear in ((with_lists, True), (ValidationContext(crls=[], **asked), False)):
        status = validate_pdf_signature(reader.embedded_signatures[0], context)
        assert status.intact and status.trusted is clear


def test_a_large_certificate_is_inspected_in_a_process_of_its_own_with_the_same_findings(signing: Signing) -> None:
    made = signing.signed(revocation_list(signing.authority), drawing=b"q Q " * (LARGE_BYTES // 4))
    file = signing.folder / "certificate.pdf"
    file.write_bytes(made)
    looked = inspect_within_limits(file, made, Trust(tuple(signing.trust)))
    assert looked == seen(made, signing.trust) and looked.signatures[0].long_term


def test_a_crafted_pdf_that_takes_too_much_memory_or_time_is_not_valid(tmp_path: Path) -> None:
    references = b"1 0 R " * ((PDF_MAX_BYTES - 1000) // 6)
    body = b"%PDF-1.7\n1 0 obj\n<</Type/Catalog/Names[" + references + b"]>>\nendobj\n"
    table = b"xref\n0 2\n0000000000 65535 f\r\n0000000009 00000 n\r\ntrailer\n<</Size 2/Root 1 0 R>>\n"
    crafted = body + table + f"startxref\n{len(body)}\n%%EOF\n".encode()
    (file := tmp_path / "crafted.pdf").write_bytes(crafted)
    limits = replace(LIMITS, processor_s=0.0)  # at most one second; a fast processor fills the memory by then
    (problem,) = inspect_within_limits(file, crafted, Trust(), limits).problems
    assert problem.name == "not_as_signed" and "it takes more than" in problem.what


def test_the_claim_is_made_only_where_an_authority_is_trusted(signing: Signing) -> None:
    made = signing.signed(revocation_list(signing.authority))
    own = signing.laboratory.chain[0].public_bytes(Encoding.DER)
    all_trusted, found = [own, *signing.trust], list[str]()
    cases = ((list[bytes](), ["signer_unknown"]), ([own], ["signer_not_trusted"]), (all_trusted, found))
    for trust, problems in cases:
        looked = seen(made, trust)
        assert [problem.name for problem in looked.problems] == problems and not looked.signatures[0].long_term


def test_a_byte_of_a_list_cannot_be_changed_unnoticed(signing: Signing) -> None:
    made = bytearray(signing.signed(revocation_list(signing.authority)))
    reader = PdfFileReader(io.BytesIO(bytes(made)))
    held = reader.root["/DSS"]["/CRLs"][0].encoded_data
    made[made.index(held) + len(held) // 2] ^= 1
    assert [problem.name for problem in seen(bytes(made), signing.trust).problems] == [
        "not_as_signed",
        "signer_not_trusted",
    ]


def test_what_no_list_clears_is_not_signed(signing: Signing) -> None:
    revoked = revocation_list(signing.authority, signing.laboratory)
    expired = revocation_list(signing.authority, days=(-9, -2))
    of_another = revocation_list(holder("Authority"))
    for lists in ((revoked,), (expired,), (of_another,), ()):
        with pytest.raises(Refused, match="revocation_list"):
            signing.signed(*lists)


def test_a_file_that_is_no_list_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "odd.crl").write_bytes(b"no list")
    with pytest.raises(Refused, match=r"revocation_list.*odd\.crl"):
        read_authorities([tmp_path / "odd.crl"])
