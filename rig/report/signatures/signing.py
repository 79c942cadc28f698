"""Signing of a certificate: the PDF by PAdES (ETSI EN 319 142-1), the digital one by XAdES (ETSI EN 319 132-1)."""

import io
import logging
from dataclasses import dataclass
from typing import Any, cast

from rig.errors import Refused
from rig.report.signatures.long_term import Authorities, unfit
from rig.report.signatures.reason import Reason
from rig.report.signatures.signatory import DIGEST, Signatory

FIELD = "Laboratory"  # the form field that readers show


def sign_as_pades(
    pdf: bytes, by: Signatory, reason: Reason, time_server: str | None = None, authorities: Authorities | None = None
) -> bytes:
    """Return the PDF with a certification signature that permits no changes, at PAdES level B-B.

    With a time server's URL the level is B-T. With `authorities` the level is B-LT, and their revocation lists are
    signed too. Raise Refused `time_server` if the server sends no time stamp, `revocation_list` if the lists do not
    cover all certificates.
    """
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
    from pyhanko.sign.fields import MDPPerm, SigSeedSubFilter
    from pyhanko.sign.general import SigningError
    from pyhanko.sign.signers import PdfSignatureMetadata, sign_pdf
    from pyhanko.sign.signers.pdf_signer import DSSContentSettings, SigDSSPlacementPreference
    from pyhanko.sign.timestamps import HTTPTimeStamper, TimestampRequestError
    from pyhanko_certvalidator.errors import PathError, ValidationError

    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)  # problems are named here
    about = PdfSignatureMetadata(
        field_name=FIELD,
        md_algorithm=DIGEST,
        reason=reason.text,
        subfilter=SigSeedSubFilter.PADES,
        certify=True,
        docmdp_permissions=MDPPerm.NO_CHANGES,
        embed_validation_info=authorities is not None,
        validation_context=None if authorities is None else authorities.context(by),
        dss_settings=DSSContentSettings(include_vri=False, placement=SigDSSPlacementPreference.TOGETHER_WITH_SIGNATURE),
    )
    stamper = None if time_server is None else HTTPTimeStamper(time_server)
    try:
        output = sign_pdf(IncrementalPdfFileWriter(io.BytesIO(pdf)), about, by.signer, timestamper=stamper)
    except (SigningError, PathError, ValidationError) as error:
        if authorities is None:
            raise
        raise unfit(" ".join(str(error).split())) from error
    except (TimestampRequestError, OSError, ValueError) as error:
        if time_server is None:
            raise
        raise Refused(
            "time_server",
            f"{time_server} gives no time stamp: {error}",
            "Give the URL of a server of RFC 3161 with --time-server, or leave it out",
        ) from error
    return bytes(output.getbuffer())


def sign_as_xades(xml: bytes, by: Signatory, reason: Reason) -> bytes:
    """Return the document with an enveloped signature over its canonical form (C14N 1.1), with time and reason."""
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
    text: bytes = etree.tostring(signed, xml_declaration=True, encoding="UTF-8")
    return text


@dataclass(frozen=True, slots=True)
class _Key:
    """A private key in the form that signxml expects: it signs, but its value, possibly in a token, stays hidden."""

    by: Signatory
    key_size: int

    def sign(self, data: bytes, **_: object) -> bytes:
        return self.by.signature(data)
