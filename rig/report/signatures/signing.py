"""A certificate signed: the PDF by PAdES (ETSI EN 319 142-1), the digital certificate by XAdES (ETSI EN 319 132-1)."""

import io
from dataclasses import dataclass
from typing import Any, cast

from rig.errors import Refused
from rig.report.signatures.reason import Reason
from rig.report.signatures.signatory import DIGEST, Signatory

FIELD = "Laboratory"  # of the form, as readers show it


def signed_pdf(pdf: bytes, by: Signatory, reason: Reason, time_server: str | None = None) -> bytes:
    """The PDF with a certification signature, after which no change is permitted: B-B, or B-T by a time server's URL.

    Raises Refused `time_server` where that gives no time stamp.
    """
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
    from pyhanko.sign.fields import MDPPerm, SigSeedSubFilter
    from pyhanko.sign.signers import PdfSignatureMetadata, sign_pdf
    from pyhanko.sign.timestamps import HTTPTimeStamper, TimestampRequestError

    about = PdfSignatureMetadata(
        field_name=FIELD,
        md_algorithm=DIGEST,
        reason=reason.text,
        subfilter=SigSeedSubFilter.PADES,
        certify=True,
        docmdp_permissions=MDPPerm.NO_CHANGES,
    )
    stamper = None if time_server is None else HTTPTimeStamper(time_server)
    try:
        made = sign_pdf(IncrementalPdfFileWriter(io.BytesIO(pdf)), about, by.signer, timestamper=stamper)
    except (TimestampRequestError, OSError, ValueError) as error:
        if time_server is None:
            raise
        raise Refused(
            "time_server",
            f"{time_server} gives no time stamp: {error}",
            "Give the URL of a server of RFC 3161 with --time-server, or leave it out",
        ) from error
    return bytes(made.getbuffer())


def signed_xml(xml: bytes, by: Signatory, reason: Reason) -> bytes:
    """The document with an enveloped signature over its canonical form (C14N 1.1), its time and reason under it."""
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPublicKey
    from lxml import etree
    from signxml.algorithms import SignatureMethod
    from signxml.xades.xades import XAdESDataObjectFormat, XAdESSigner

    public = by.certificates[0].public_key()
    rsa = isinstance(public, RSAPublicKey)
    signer = XAdESSigner(
        data_object_format=XAdESDataObjectFormat(Description=reason.text, MimeType="text/xml"),
        signature_algorithm=SignatureMethod.RSA_SHA256 if rsa else SignatureMethod.ECDSA_SHA256,
        digest_algorithm=DIGEST,
    )
    key = cast(Any, _Key(by, cast(Any, public).key_size))
    signed = signer.sign(etree.fromstring(xml), key=key, cert=list(by.certificates), always_add_key_value=False)
    made: bytes = etree.tostring(signed, xml_declaration=True, encoding="UTF-8")
    return made


@dataclass(frozen=True, slots=True)
class _Key:
    """A private key as signxml uses one; it may be in a token, and cannot be had."""

    by: Signatory
    key_size: int

    def sign(self, data: bytes, **_: object) -> bytes:
        return self.by.signature(data)
