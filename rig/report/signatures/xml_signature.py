"""The signature of a digital certificate: over the canonical form of all of it, and nothing may stand beside that."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509 import Certificate, load_pem_x509_certificate
from lxml import etree
from signxml.exceptions import SignXMLException
from signxml.util import add_pem_header, namespaces
from signxml.xades.xades import XAdESSignatureConfiguration, XAdESVerifier

from rig.report.signatures.findings import Looked, Seen, not_as_signed, not_signed, signer_not_trusted, untrusted
from rig.report.signatures.reason import Reason

NAMES = {"ds": namespaces.ds, "xades": namespaces.xades}
ITSELF, ITS_PROPERTIES, ITS_CERTIFICATES = range(3)  # what is signed, in this order


def seen_xml(name: str, content: bytes, trust: Sequence[bytes]) -> Looked:
    """An XML document's signature. Raises whatever its reader does of a damaged one."""
    root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True))
    signatures = root.findall("ds:Signature", NAMES)
    if not signatures:
        return Looked(problems=(not_signed(name),))
    texts = [each.text for each in signatures[0].iterfind("ds:KeyInfo/ds:X509Data/ds:X509Certificate", NAMES)]
    chain = [load_pem_x509_certificate(add_pem_header(each)) for each in texts]
    beside = [*_uncovered(root), *(["it has several signatures"] if len(signatures) > 1 else [])]
    try:
        signed = _signed(content, chain[0])
    except SignXMLException as error:
        return Looked(problems=(not_as_signed(name, " ".join(str(error).split())),))
    if signed[ITSELF].signature_xml.find("ds:SignedInfo/ds:Reference", NAMES).get("URI") != "":
        beside.append("its signature is over a part of it")
    seen, why = _seen(chain, signed[ITS_PROPERTIES].signed_xml, trust)
    problems = [not_as_signed(name, each) for each in beside]
    if why:
        problems.append(signer_not_trusted(name, seen.signer, why))
    return Looked((seen,), {}, tuple(problems))


def _signed(content: bytes, own: Certificate) -> Any:
    """What the key of this certificate has signed. Raises SignXMLException."""
    # Whether the certificate is valid is asked later, of the moment that counts.
    form = XAdESSignatureConfiguration(location="./", expect_references=3, verification_time=own.not_valid_after_utc)
    return XAdESVerifier().verify(content, x509_cert=own, expect_config=form)


def _uncovered(root: Any) -> Iterator[str]:
    """What the canonical form leaves out, and who reads the file may see."""
    if root.getroottree().docinfo.doctype:
        yield "it has a document type, which no signature covers"
    around = [*root.itersiblings(), *root.itersiblings(preceding=True)]
    if around or next(root.iter(etree.Comment, etree.ProcessingInstruction, etree.Entity), None) is not None:
        yield "it has comments or instructions, which no signature covers"


def _seen(chain: Sequence[Certificate], properties: Any, trust: Sequence[bytes]) -> tuple[Seen, str]:
    """The signature, and why its signer is not trusted, or nothing."""
    said = properties.findtext(".//xades:SigningTime", None, NAMES)
    der = [each.public_bytes(Encoding.DER) for each in chain]
    why = untrusted(der, trust, datetime.now(UTC)) if trust else ""
    seen = Seen(
        signer=chain[0].subject.rfc4514_string(),
        certificate_sha256=chain[0].fingerprint(SHA256()).hex(),
        when=None if said is None else datetime.fromisoformat(said),
        time_server=None,
        reason=Reason(properties.findtext(".//xades:DataObjectFormat/xades:Description", "", NAMES)),
        trusted=not why if trust else None,
    )
    return seen, why
