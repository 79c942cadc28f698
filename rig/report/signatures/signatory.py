"""Who signs: a key with its certificates, from a file (PKCS#12, PEM) or in a PKCS#11 token. The extra `sign`."""

import asyncio
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.report.signatures.token_address import PASSPHRASE, TokenKey, is_token_address, token_key
from rig.report.signatures.trust import chain_of, unfit_for_documents

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

EXTRA, DIGEST = "sign", "sha256"
SIZE_MAX_BYTES = 1_000_000
_BLOCK = re.compile(rb"-----BEGIN ([A-Z ]*PRIVATE KEY)-----.*?-----END \1-----", re.DOTALL)
REMEDY = f"Give a PKCS#12 or PEM file that holds an RSA or EC key with its certificate; its passphrase in {PASSPHRASE}"


@dataclass(frozen=True, slots=True)
class Signatory:
    """`signer` is pyHanko's; `certificates` that of the key first, then those that lead to its root."""

    signer: Any
    certificates: "tuple[Certificate, ...]"

    def signature(self, data: bytes) -> bytes:
        """The signature of `data` by SHA-256, of an EC key in DER."""
        made: bytes = asyncio.run(self.signer.async_sign_raw(data, DIGEST))
        return made


@contextmanager
def signatory(where: str) -> Iterator[Signatory]:
    """The one whose key is in this file, or in a token: `pkcs11:token=NAME;object=NAME?module-path=LIBRARY` (RFC 7512).

    Raises Refused `signing_key`, `missing_extra`.
    """
    try:
        import pyhanko.sign  # noqa: F401
        import signxml  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, EXTRA) from error
    if is_token_address(where):
        key = token_key(where)
        with _of_token(key) as found:
            _check(found, key.label)
            yield found
    else:
        with _of_file(Path(where)) as found:
            _check(found, where)
            yield found


@contextmanager
def _of_file(file: Path) -> Iterator[Signatory]:
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.serialization import pkcs12
    from cryptography.x509 import load_pem_x509_certificates
    from pyhanko.keys.internal import (
        translate_pyca_cryptography_cert_to_asn1,
        translate_pyca_cryptography_key_to_asn1,
    )
    from pyhanko.sign.signers import SimpleSigner
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    said = os.environ.get(PASSPHRASE)
    passphrase = None if said is None else said.encode()
    try:
        content = read_regular_file(file, SIZE_MAX_BYTES)
        block = _BLOCK.search(content)
        if block is None and b"-----BEGIN" not in content:
            key, own, others = pkcs12.load_key_and_certificates(content, passphrase)
            certificates = [each for each in (own, *others) if each is not None]
        else:
            text = b"" if block is None else block.group()
            key = serialization.load_pem_private_key(text, passphrase if b"ENCRYPTED" in text else None)
            certificates = load_pem_x509_certificates(content)
    except (UnfitFile, OSError, ValueError, TypeError) as error:
        raise _unfit(str(file), str(getattr(error, "strerror", None) or error)) from None
    ordered = _own_first(certificates, key)
    if key is None or not ordered:
        raise _unfit(str(file), "it does not hold a key and the certificate of this key")
    known = SimpleCertificateStore()  # of those above it; its own comes by itself
    known.register_multiple(map(translate_pyca_cryptography_cert_to_asn1, ordered[1:]))
    try:
        own_key = translate_pyca_cryptography_key_to_asn1(key)
    except (ValueError, TypeError, NotImplementedError) as error:
        raise _unfit(str(file), str(error)) from None
    yield Signatory(
        SimpleSigner(
            signing_cert=translate_pyca_cryptography_cert_to_asn1(ordered[0]),
            signing_key=own_key,
            cert_registry=known,
        ),
        tuple(ordered),
    )


def _own_first(certificates: "Sequence[Certificate]", key: Any) -> "list[Certificate]":
    """The certificates, the key's own before those above it; empty where none is of the key."""
    own = [] if key is None else [each for each in certificates if each.public_key() == key.public_key()]
    return chain_of([own[0], *certificates]) if own else []


@contextmanager
def _of_token(key: TokenKey) -> Iterator[Signatory]:
    """The key in a token and the certificate beside it, both of one label."""
    try:
        import pkcs11
        from pyhanko.config.pkcs11 import TokenCriteria
        from pyhanko.keys.internal import translate_pyca_cryptography_cert_to_asn1
        from pyhanko.sign.pkcs11 import PKCS11Signer, open_pkcs11_session
    except ImportError as error:
        raise missing_extra(error, EXTRA) from error
    from cryptography.x509 import load_der_x509_certificate

    try:
        session = open_pkcs11_session(
            key.module_path, token_criteria=TokenCriteria(label=key.token), user_pin=os.environ.get(PASSPHRASE)
        )
        with session:
            all_there = PKCS11Signer(session, cert_label=key.name, key_label=key.name, other_certs_to_pull=None)
            asyncio.run(all_there.ensure_objects_loaded())
            if all_there.signing_cert is None:
                raise _unfit(key.label, "no certificate of that name is in the token")
            found = (all_there.signing_cert, *all_there.cert_registry)
            certificates = chain_of([load_der_x509_certificate(one.dump()) for one in found])
            above = map(translate_pyca_cryptography_cert_to_asn1, certificates[1:])
            signer = PKCS11Signer(session, cert_label=key.name, key_label=key.name, ca_chain=list(above))
            asyncio.run(signer.ensure_objects_loaded())
            signer.use_raw_mechanism = all_there.signing_cert.public_key.algorithm == "ec"  # many hash for RSA alone
            yield Signatory(signer, tuple(certificates))
    except pkcs11.exceptions.PKCS11Error as error:
        raise _unfit(key.label, str(error) or type(error).__name__) from error


def _check(signatory: Signatory, where: str) -> None:
    """Raises Refused `signing_key` where a certificate is not valid now, or a verifier would not accept its key."""
    own = signatory.certificates[0]
    for why in unfit_for_documents(own):
        raise _unfit(where, why)
    if not own.not_valid_before_utc <= datetime.now(UTC) <= own.not_valid_after_utc:
        days = f"{own.not_valid_before_utc:%Y-%m-%d} to {own.not_valid_after_utc:%Y-%m-%d}"
        raise _unfit(where, f"its certificate is valid from {days}, and not now")


def _unfit(where: str, why: str) -> Refused:
    return Refused("signing_key", f"{where} cannot sign: {why}", REMEDY)
