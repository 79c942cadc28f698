"""Trusted certificates of a verifier, and the check of a signer's certificate for signing documents (RFC 5280)."""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from asn1crypto.crl import CertificateList
    from cryptography.x509 import Certificate, Extension, ExtensionType
    from pyhanko_certvalidator.authority import CertTrustAnchor

ExtensionT = TypeVar("ExtensionT", bound="ExtensionType")
RSA_MIN_BITS, EC_MIN_BITS = 2048, 256  # ETSI TS 119 312, clause 6.2: recommended today
MAX_CLOCK_ERROR = timedelta(days=1)  # of this computer, or in its time zone
DOCUMENT_PURPOSES = {
    "1.3.6.1.5.5.7.3.36": "documents (RFC 9336)",
    "1.3.6.1.4.1.311.10.3.12": "documents (Microsoft)",
    "1.2.840.113583.1.1.5": "documents (Adobe)",
    "1.3.6.1.5.5.7.3.4": "e-mail",  # issued to signers of documents before RFC 9336
    "2.5.29.37.0": "any purpose",
}


@dataclass(frozen=True, slots=True)
class Trust:
    """Trusted certificates (DER), of signers or of their authorities, and the required name of the signer."""

    certificates: tuple[bytes, ...] = ()
    signer: str | None = None


def why_untrusted(
    chain: Sequence[bytes], trust: Trust, moment: datetime, lists: "Sequence[CertificateList]" = ()
) -> str:
    """Return why the signer, whose certificate begins this `chain` (DER), is not trusted; empty if trusted.

    The certificate must be valid at the `moment`, have a chain to a trusted certificate, be intended for signing
    documents, and have the expected name. The certificates above it in the chain must permit their keys to issue
    certificates for signing documents. Revocation `lists`, if given, must cover the whole chain.
    """
    from cryptography.x509 import load_der_x509_certificate

    leaf = load_der_x509_certificate(chain[0])
    begin, end = leaf.not_valid_before_utc, leaf.not_valid_after_utc
    if not begin <= moment <= end:  # path validation does not test this for a certificate that is itself trusted
        return f"the certificate is valid from {begin:%Y-%m-%d} to {end:%Y-%m-%d}, not on {moment:%Y-%m-%d}"
    return (
        _no_path(chain, trust, moment, lists) or next(unfit_for_documents(leaf), "") or _other_name(leaf, trust.signer)
    )


def trust_anchors(trust: Trust) -> "list[CertTrustAnchor]":
    """Return the trusted certificates with the limits that they state: path length, names (RFC 5937) and last day."""
    from asn1crypto.x509 import Certificate
    from pyhanko_certvalidator.authority import CertTrustAnchor, TrustQualifiers, derive_quals_from_cert
    from pyhanko_certvalidator.policy_decl import PKIXValidationParams

    anchors = []
    for certificate in map(Certificate.load, trust.certificates):
        limits = derive_quals_from_cert(certificate)
        names = limits.standard_parameters or PKIXValidationParams()
        names = PKIXValidationParams(  # without its policies, which the certificates below need not state
            initial_permitted_subtrees=names.initial_permitted_subtrees,
            initial_excluded_subtrees=names.initial_excluded_subtrees,
        )
        length = limits.max_path_length  # pyHanko needs it twice, also for attribute certificates
        anchors.append(
            CertTrustAnchor(certificate, TrustQualifiers(names, length, length, valid_until=limits.valid_until))
        )
    return anchors


def _no_path(chain: Sequence[bytes], trust: Trust, moment: datetime, lists: "Sequence[CertificateList]") -> str:
    """Return why the certificate does not lead to a trusted one at the time `moment`; empty if it does."""
    from asn1crypto.x509 import Certificate
    from cryptography.x509 import load_der_x509_certificate
    from pyhanko_certvalidator import CertificateValidator, ValidationContext
    from pyhanko_certvalidator.errors import PathError, ValidationError

    certificate, *others = map(Certificate.load, chain)
    context = ValidationContext(
        trust_roots=trust_anchors(trust),
        other_certs=others,
        moment=moment,
        crls=list(lists),
        revocation_mode="require" if lists else "soft-fail",
        allow_fetching=False,
    )
    try:
        validator = CertificateValidator(certificate, validation_context=context)
        path = asyncio.run(validator.async_validate_usage(set()))
    except (PathError, ValidationError) as error:
        return " ".join(str(error).split())
    authorities = [load_der_x509_certificate(one.dump()) for one in path.iter_certs(include_root=True)][:-1]
    if not authorities and chain[0] not in trust.certificates:
        return "another certificate of the same name and key is the trusted one"
    return next((why for authority in authorities for why in _unfit_authority(authority)), "")


def _unfit_authority(certificate: "Certificate") -> Iterator[str]:
    """Yield reasons why the owner of this certificate may not issue certificates for signing documents."""
    from cryptography.x509 import BasicConstraints

    name = certificate.subject.rfc4514_string()
    constraints = _find_extension(certificate, BasicConstraints)
    if constraints is None or not constraints.value.ca:
        yield f"it was issued by {name}, who is no authority"
    yield from (f"its authority {name}: the {why}" for why in (*_other_purposes(certificate), *_weak_key(certificate)))


def unfit_for_documents(certificate: "Certificate") -> Iterator[str]:
    """Yield reasons why the key of this certificate may not sign documents: its stated uses, its type or its length.

    A certificate without key usage is not accepted, although RFC 5280 (4.2.1.3) permits it all usages, because
    certificates of web servers from small authorities often state no key usage.
    """
    from cryptography.x509 import KeyUsage

    usage = _find_extension(certificate, KeyUsage)
    if usage is None or not (usage.value.digital_signature or usage.value.content_commitment):
        yield "its certificate is not made for signing documents: the key usage is not digitalSignature"
    yield from (f"its {why}" for why in (*_other_purposes(certificate), *_weak_key(certificate)))


def _other_purposes(certificate: "Certificate") -> Iterator[str]:
    """Yield the purposes of a certificate, if it states them (extended key usage) and documents are not among them."""
    from cryptography.x509 import ExtendedKeyUsage

    stated = _find_extension(certificate, ExtendedKeyUsage)
    if stated is None:
        return
    purposes = [purpose.dotted_string for purpose in stated.value]
    if not DOCUMENT_PURPOSES.keys() & purposes:
        yield f"certificate is not made for signing documents: its extended key usage is {', '.join(purposes)}"


def _weak_key(certificate: "Certificate") -> Iterator[str]:
    """Yield a reason if the key of a certificate is too short, or is neither an RSA nor an EC key."""
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePublicKey
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPublicKey

    key = certificate.public_key()
    if not isinstance(key, RSAPublicKey | EllipticCurvePublicKey):
        yield "key is neither RSA nor EC"
    elif key.key_size < (RSA_MIN_BITS if isinstance(key, RSAPublicKey) else EC_MIN_BITS):
        yield f"key is weak: it has {key.key_size} bits"


def unfit_for_stamps(certificate: "Certificate", moment: datetime, now: datetime) -> Iterator[str]:
    """Yield reasons why a time server with this certificate could not stamp at the time `moment` (RFC 3161, 2.3)."""
    from cryptography.x509 import ExtendedKeyUsage
    from cryptography.x509.oid import ExtendedKeyUsageOID

    stated = _find_extension(certificate, ExtendedKeyUsage)
    if stated is None or not stated.critical or [*stated.value] != [ExtendedKeyUsageOID.TIME_STAMPING]:
        yield "its certificate is not made for time stamps alone"
    if not certificate.not_valid_before_utc <= moment <= certificate.not_valid_after_utc:
        yield f"its certificate was not valid on {moment:%Y-%m-%d}"
    if moment > now + MAX_CLOCK_ERROR:
        yield f"it is of {moment:%Y-%m-%d}, which is to come"


def _find_extension(certificate: "Certificate", kind: type[ExtensionT]) -> "Extension[ExtensionT] | None":
    """Return the extension of a `kind` in a certificate, or None without it."""
    from cryptography.x509 import ExtensionNotFound

    try:
        return certificate.extensions.get_extension_for_class(kind)
    except ExtensionNotFound:
        return None


def _other_name(certificate: "Certificate", expected: str | None) -> str:
    from cryptography.x509.oid import NameOID

    subject = certificate.subject
    names = [str(name.value) for name in subject.get_attributes_for_oid(NameOID.COMMON_NAME)]
    if expected is None or expected == subject.rfc4514_string() or names == [expected]:
        return ""
    return f"the name that --signer expects is {expected}"


def find_unvouched(chain: "Sequence[Certificate]", trust: Trust) -> list["Certificate"]:
    """Return those certificates of a signer's `chain`, after the first one, whose content nothing verifies.

    The signature itself identifies the first certificate. Each further certificate is verified if it is trusted, or if
    a trusted certificate or one in the chain has issued it.
    """
    from cryptography.hazmat.primitives.serialization import Encoding
    from cryptography.x509 import load_der_x509_certificate

    issuers = [*chain, *map(load_der_x509_certificate, trust.certificates)]
    return [
        one
        for one in chain
        if one != chain[0]
        and one.public_bytes(Encoding.DER) not in trust.certificates
        and not any(_has_issued(issuer, one) for issuer in issuers)
    ]


def chain_of(certificates: "Sequence[Certificate]") -> list["Certificate"]:
    """Return the first certificate, then its issuers up to the root, as far as the other certificates include them."""
    chain, rest = [certificates[0]], [other for other in certificates if other != certificates[0]]
    while issuers := [other for other in rest if any(_has_issued(other, one) for one in chain)]:
        chain += issuers
        rest = [other for other in rest if other not in issuers]
    return chain


def _has_issued(issuer: "Certificate", certificate: "Certificate") -> bool:
    from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm

    try:
        certificate.verify_directly_issued_by(issuer)
    except (InvalidSignature, UnsupportedAlgorithm, ValueError, TypeError):
        return False
    return True
