"""Content of a signature's container (CMS, RFC 5652) that the signature does not cover, which is not allowed."""

from collections.abc import Iterator
from typing import Any

from asn1crypto import cms
from cryptography.x509 import Certificate, load_der_x509_certificate
from pyhanko.sign.general import extract_certificate_info

from rig.report.signatures.signatory import DIGEST
from rig.report.signatures.trust import chain_of

DATA_VERSION, STAMPED_VERSION = "v1", "v3"  # versions of a container, by its content (RFC 5652, 5.1)
PLAIN_METHODS = ("sha256_rsa", "rsassa_pkcs1v15", "sha256_ecdsa")
PSS_METHOD = "rsassa_pss"


def find_uncovered_in_container(der: bytes) -> Iterator[str]:
    """Yield the parts of a signature's container that the signature does not cover.

    `der` is the ContentInfo of a document's signature, which covers its signed attributes only. A container is rebuilt
    from these attributes, the signature's value, the certificates of the signer's chain, and at most one time stamp,
    which is tested likewise. The original must equal the rebuilt container byte by byte. Whether the certificates are
    genuine is not tested.
    """
    content = cms.ContentInfo.load(der, strict=True)
    (info,) = content["content"]["signer_infos"]
    method = info["signature_algorithm"]["algorithm"].native
    if info["digest_algorithm"]["algorithm"].native != DIGEST or method not in PLAIN_METHODS:
        yield f"it is signed by a method that is not accepted: {method}"
    if "signing_certificate_v2" not in [attribute["type"].native for attribute in info["signed_attrs"]]:
        yield "its signed attributes do not name the signer's certificate"
    yield from _find_uncovered(content, der, DATA_VERSION)
    stamps = [(attribute["type"].native, list(attribute["values"])) for attribute in info["unsigned_attrs"] or ()]
    if [(kind, len(values)) for kind, values in stamps] not in ([], [("signature_time_stamp_token", 1)]):
        yield "its signature has more unsigned attributes than a time stamp"
        return
    for _, (stamp,) in stamps:
        yield from _find_uncovered(stamp, stamp.dump(), STAMPED_VERSION)
        if stamp["content"]["signer_infos"][0]["unsigned_attrs"]:
            yield "its time stamp has unsigned attributes"


def certificates_with(der: bytes) -> list[list[Certificate]]:
    """Return lists of certificates: a signature's, then its time stamp's; each list begins with the signer's own."""
    contents = [cms.ContentInfo.load(der)["content"]]
    for attribute in contents[0]["signer_infos"][0]["unsigned_attrs"] or ():
        contents += [stamp["content"] for stamp in attribute["values"]]
    return [_certificates(content) for content in contents]


def _certificates(content: Any) -> list[Certificate]:
    signer = extract_certificate_info(content).signer_cert  # if two claim to be the signer's, the last one
    certificates = (signer, *(choice.chosen for choice in content["certificates"]))
    return [load_der_x509_certificate(one.dump()) for one in certificates]


def _find_uncovered(content: Any, der: bytes, version: str) -> Iterator[str]:
    """Yield the parts of the signature's container that are not signed."""
    container = content["content"]
    (info,) = container["signer_infos"]
    if _rebuild(container, info, extract_certificate_info(container).signer_cert, version).dump() != der:
        yield "its signature's container has content that is not signed"
    if any(choice.name != "certificate" for choice in container["certificates"]):
        yield "its signature's container has other things than certificates of keys"
    certificates = _certificates(container)
    chain = chain_of(certificates)
    for unrelated in (certificate for certificate in certificates if certificate not in chain):
        yield f"its signature's container has an unrelated certificate of {unrelated.subject.rfc4514_string()}"


def _rebuild(container: Any, info: Any, signer: Any, version: str) -> Any:
    """Return a container with nothing but the content that the signature covers, for comparison byte for byte."""
    digest = info["digest_algorithm"]
    digests = [one for one in container["digest_algorithms"] if one["algorithm"].native == digest["algorithm"].native]
    who = {"issuer": signer.issuer, "serial_number": signer.serial_number}
    by = {
        "version": "v1",
        "sid": cms.SignerIdentifier("issuer_and_serial_number", cms.IssuerAndSerialNumber(who)),
        "digest_algorithm": _drop_parameters(digest),
        "signed_attrs": info["signed_attrs"],
        "signature_algorithm": _drop_parameters(info["signature_algorithm"]),
        "signature": info["signature"],
    }
    if info["unsigned_attrs"]:
        by["unsigned_attrs"] = info["unsigned_attrs"]
    signed = {
        "version": version,
        "digest_algorithms": list(map(_drop_parameters, digests)),
        "encap_content_info": {"content_type": "data"} if version == DATA_VERSION else container["encap_content_info"],
        "certificates": container["certificates"],
        "signer_infos": [cms.SignerInfo(by)],
    }
    return cms.ContentInfo({"content_type": "signed_data", "content": cms.SignedData(signed)})


def _drop_parameters(algorithm: Any) -> Any:
    """Return the algorithm without parameters, or with NULL as parameters if the original has NULL.

    The parameters of `PSS_METHOD` are part of the method and remain.
    """
    name = algorithm["algorithm"].native
    if name == PSS_METHOD:
        return algorithm
    nones: tuple[dict[str, None], ...] = ({}, {"parameters": None})
    forms = [type(algorithm)({"algorithm": name, **none}) for none in nones]
    return next((form for form in forms if form.dump() == algorithm.dump()), forms[0])
