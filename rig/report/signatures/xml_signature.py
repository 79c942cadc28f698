"""The signature of a digital certificate (XAdES): the document must equal one rebuilt from verified content."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from cryptography.hazmat.primitives.asymmetric.rsa import RSAPublicKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509 import Certificate, load_pem_x509_certificate
from signxml.algorithms import DigestAlgorithm, SignatureMethod
from signxml.exceptions import SignXMLException
from signxml.util import add_pem_header
from signxml.xades.xades import XAdESSignatureConfiguration, XAdESVerifier

from rig.report.signatures.findings import (
    FileInspection,
    SignatureReport,
    list_signer_doubts,
    not_as_signed,
    not_signed,
)
from rig.report.signatures.reason import Reason
from rig.report.signatures.trust import Trust, why_untrusted
from rig.report.signatures.xml_document import NAMES, canonical, read_xml, rebuild_document

DCC = "{https://ptb.de/dcc}"


def inspect_xml(name: str, content: bytes, trust: Trust) -> FileInspection:
    """Return the inspection of an XML document's signature. Raise the errors of its reader for a damaged file."""
    root = read_xml(content)
    signature = root.find("ds:Signature", NAMES)
    if signature is None:
        return FileInspection(problems=(not_signed(name),))
    texts = [element.text for element in signature.iterfind("ds:KeyInfo/ds:X509Data/ds:X509Certificate", NAMES)]
    chain = [load_pem_x509_certificate(add_pem_header(text)) for text in texts]
    method = _method(chain[0])
    try:
        signed = _verify(root, chain[0], method)
    except SignXMLException as error:
        return FileInspection(problems=(not_as_signed(name, " ".join(str(error).split())),))
    document, properties, key_info = signed  # in this order
    value = signature.findtext("ds:SignatureValue", "", NAMES)
    verified = (document.signed_data, properties.signed_data, key_info.signed_data)
    if canonical(root) != canonical(rebuild_document(verified, method.value, value)):
        return FileInspection(problems=(not_as_signed(name, "it has content that its signature does not cover"),))
    if not _is_one_certificate(document.signed_xml):
        why = "the signed document is not a digital certificate with one set of results"
        return FileInspection(problems=(not_as_signed(name, why),))
    report, problems = _inspect(name, chain, properties.signed_xml, trust)
    return FileInspection((report,), {}, problems)


def _method(certificate: Certificate) -> SignatureMethod:
    """Return the signature method for the kind of the certificate's key."""
    rsa = isinstance(certificate.public_key(), RSAPublicKey)
    return SignatureMethod.RSA_SHA256 if rsa else SignatureMethod.ECDSA_SHA256


def _verify(root: Any, certificate: Certificate, method: SignatureMethod) -> Any:
    """Return the content that the certificate's key has signed. Raise SignXMLException for a wrong signature."""
    form = XAdESSignatureConfiguration(
        location="./",
        expect_references=3,
        signature_methods=frozenset({method}),
        digest_algorithms=frozenset({DigestAlgorithm.SHA256}),
        verification_time=certificate.not_valid_after_utc,  # its validity is tested later, for the relevant moment
    )
    return XAdESVerifier().verify(root, x509_cert=certificate, expect_config=form)


def _is_one_certificate(root: Any) -> bool:
    results = list(root.iter(f"{DCC}measurementResults"))
    return root.tag == f"{DCC}digitalCalibrationCertificate" and [element.getparent() for element in results] == [root]


def _inspect(name: str, chain: Sequence[Certificate], properties: Any, trust: Trust) -> tuple[SignatureReport, Any]:
    """Return the signature's report, and a tuple with the problem of its signer, if any."""
    time = properties.findtext(".//xades:SigningTime", None, NAMES)
    der = [certificate.public_bytes(Encoding.DER) for certificate in chain]
    why = why_untrusted(der, trust, datetime.now(UTC)) if trust.certificates else ""
    report = SignatureReport(
        signer=chain[0].subject.rfc4514_string(),
        certificate_sha256=chain[0].fingerprint(SHA256()).hex(),
        when=None if time is None else datetime.fromisoformat(time),
        time_server=None,
        reason=Reason(properties.findtext(".//xades:DataObjectFormat/xades:Description", "", NAMES)),
        trusted=not why if trust.certificates else None,
    )
    return report, tuple(list_signer_doubts(name, report, why))
