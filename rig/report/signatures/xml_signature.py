"""The signature of a digital certificate (XAdES): the document must be what can be rebuilt of what is verified."""

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
    Looked,
    Seen,
    not_as_signed,
    not_signed,
    signer_not_trusted,
    signer_unknown,
)
from rig.report.signatures.reason import Reason
from rig.report.signatures.trust import Trust, why_untrusted
from rig.report.signatures.xml_document import NAMES, canonical, read_xml, rebuilt

DCC = "{https://ptb.de/dcc}"


def seen_xml(name: str, content: bytes, trust: Trust) -> Looked:
    """Return what an XML document's signature shows. Raises whatever its reader does of a damaged one."""
    root = read_xml(content)
    signature = root.find("ds:Signature", NAMES)
    if signature is None:
        return Looked(problems=(not_signed(name),))
    texts = [element.text for element in signature.iterfind("ds:KeyInfo/ds:X509Data/ds:X509Certificate", NAMES)]
    chain = [load_pem_x509_certificate(add_pem_header(text)) for text in texts]
    method = _method(chain[0])
    try:
        signed = _signed(root, chain[0], method)
    except SignXMLException as error:
        return Looked(problems=(not_as_signed(name, " ".join(str(error).split())),))
    document, properties, key_info = signed  # in this order
    value = signature.findtext("ds:SignatureValue", "", NAMES)
    verified = (document.signed_data, properties.signed_data, key_info.signed_data)
    if canonical(root) != canonical(rebuilt(verified, method.value, value)):
        return Looked(problems=(not_as_signed(name, "it holds something that its signature does not cover"),))
    if not _is_one_certificate(document.signed_xml):
        why = "what is signed is no digital certificate with one set of results"
        return Looked(problems=(not_as_signed(name, why),))
    seen, problems = _seen(name, chain, properties.signed_xml, trust)
    return Looked((seen,), {}, problems)


def _method(own: Certificate) -> SignatureMethod:
    """The method by which the rig signs with a key of this kind."""
    rsa = isinstance(own.public_key(), RSAPublicKey)
    return SignatureMethod.RSA_SHA256 if rsa else SignatureMethod.ECDSA_SHA256


def _signed(root: Any, own: Certificate, method: SignatureMethod) -> Any:
    """What the key of this certificate has signed. Raises SignXMLException."""
    form = XAdESSignatureConfiguration(
        location="./",
        expect_references=3,
        signature_methods=frozenset({method}),
        digest_algorithms=frozenset({DigestAlgorithm.SHA256}),
        verification_time=own.not_valid_after_utc,  # whether it is valid is asked later, of the moment that counts
    )
    return XAdESVerifier().verify(root, x509_cert=own, expect_config=form)


def _is_one_certificate(root: Any) -> bool:
    results = list(root.iter(f"{DCC}measurementResults"))
    return root.tag == f"{DCC}digitalCalibrationCertificate" and [each.getparent() for each in results] == [root]


def _seen(name: str, chain: Sequence[Certificate], properties: Any, trust: Trust) -> tuple[Seen, Any]:
    """The signature, and why its signer is not to be relied on, or nothing."""
    said = properties.findtext(".//xades:SigningTime", None, NAMES)
    der = [each.public_bytes(Encoding.DER) for each in chain]
    why = why_untrusted(der, trust, datetime.now(UTC)) if trust.certificates else ""
    seen = Seen(
        signer=chain[0].subject.rfc4514_string(),
        certificate_sha256=chain[0].fingerprint(SHA256()).hex(),
        when=None if said is None else datetime.fromisoformat(said),
        time_server=None,
        reason=Reason(properties.findtext(".//xades:DataObjectFormat/xades:Description", "", NAMES)),
        trusted=not why if trust.certificates else None,
    )
    if not trust.certificates:
        return seen, (signer_unknown(name, seen.signer),)
    return seen, (signer_not_trusted(name, seen.signer, why),) if why else ()
