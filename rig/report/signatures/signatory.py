"""The signing key with its certificates, from a file (PKCS#12, PEM) or in a PKCS#11 token. Needs the extra `sign`."""

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
from rig.errors.extras import requiring
from rig.report.signatures.token_address import PASSPHRASE, TokenKey, is_token_address, token_key
from rig.report.signatures.trust import chain_of, unfit_for_documents

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

EXTRA, DIGEST = "sign", "sha256"
SIZE_MAX_BYTES = 1_000_000
_BLOCK = re.compile(rb"-----BEGIN ([A-Z ]*PRIVATE KEY)-----.*?-----END \1-----", re.DOTALL)
REMEDY = f"Give a PKCS#12 or PEM file with an RSA or EC key and its certificate; its passphrase in {PASSPHRASE}"


@dataclass(frozen=True, slots=True)
class Signatory:
    """The `signer` of pyHanko, and its `certificates`: the key's own first, then its issuers' up to the root."""

    signer: Any
    certificates: "tuple[Certificate, ...]"

    def signature(self, data: bytes) -> bytes:
        """Return the signature of `data` with SHA-256; an EC key's signature is in DER."""
        signature: bytes = asyncio.run(self.signer.async_sign_raw(data, DIGEST))
        return signature


@contextmanager
def signatory(where: str) -> Iterator[Signatory]:
    """Yield the key in a file, or in a token: `pkcs11:token=NAME;object=NAME?module-path=LIBRARY` (RFC 7512).

    Raise Refused `signing_key`, `missing_extra`.
    """
    with requiring(EXTRA):
        import pyhanko.sign  # noqa: F401
        import signxml  # noqa: F401
    if is_token_address(where):
        key = token_key(where)
        with _open_token(key) as opened:
            _check(opened, key.label)
            yield opened
    else:
        with _open_file(Path(where)) as opened:
            _check(opened, where)
            yield opened


@contextmanager
def _open_file(file: Path) -> Iterator[Signatory]:
    """Yield the key and certificates of a PKCS#12 or PEM file. Raise Refused `signing_key`."""
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.serialization import pkcs12
    from cryptography.x509 import load_pem_x509_certificates
    from pyhanko.keys.internal import translate_pyca_cryptography_cert_to_asn1, translate_pyca_cryptography_key_to_asn1
    from pyhanko.sign.signers import SimpleSigner
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    variable = os.environ.get(PASSPHRASE)
    passphrase = None if variable is None else variable.encode()
    try:
        content = read_regular_file(file, SIZE_MAX_BYTES)
        block = _BLOCK.search(content)
        if block is None and b"-----BEGIN" not in content:
            key, key_certificate, others = pkcs12.load_key_and_certificates(content, passphrase)
            certificates = [one for one in (key_certificate, *others) if one is not None]
        else:
            text = b"" if block is None else block.group()
            key = serialization.load_pem_private_key(text, passphrase if b"ENCRYPTED" in text else None)
            certificates = load_pem_x509_certificates(content)
    except (UnfitFile, OSError, ValueError, TypeError) as error:
        raise _unfit(str(file), str(getattr(error, "strerror", None) or error)) from None
    ordered = _order_chain(certificates, key)
    if key is None or not ordered:
        raise _unfit(str(file), "it does not contain a key and the certificate of this key")
    store = SimpleCertificateStore()  # for the certificates above it; pyHanko adds the first
    store.register_multiple(map(translate_pyca_cryptography_cert_to_asn1, ordered[1:]))
    try:
        own_key = translate_pyca_cryptography_key_to_asn1(key)
    except (ValueError, TypeError, NotImplementedError) as error:
        raise _unfit(str(file), str(error)) from None
    yield Signatory(
        SimpleSigner(
            signing_cert=translate_pyca_cryptography_cert_to_asn1(ordered[0]),
            signing_key=own_key,
            cert_registry=store,
        ),
        tuple(ordered),
    )


def _order_chain(certificates: "Sequence[Certificate]", key: Any) -> "list[Certificate]":
    """Return the key's own certificate, then its issuers' certificates; an empty list without the key's own."""
    matching = [one for one in certificates if key is not None and one.public_key() == key.public_key()]
    return chain_of([matching[0], *certificates]) if matching else []


@contextmanager
def _open_token(key: TokenKey) -> Iterator[Signatory]:
    """Yield the key in a token, and its certificate, which has the same label."""
    with requiring(EXTRA):
        import pkcs11
        from pyhanko.config.pkcs11 import TokenCriteria
        from pyhanko.keys.internal import translate_pyca_cryptography_cert_to_asn1
        from pyhanko.sign.pkcs11 import PKCS11Signer, open_pkcs11_session
    from cryptography.x509 import load_der_x509_certificate

    try:
        session = open_pkcs11_session(
            key.module_path, token_criteria=TokenCriteria(label=key.token), user_pin=os.environ.get(PASSPHRASE)
        )
        with session:
            loader = PKCS11Signer(session, cert_label=key.name, key_label=key.name, other_certs_to_pull=None)
            asyncio.run(loader.ensure_objects_loaded())
            if loader.signing_cert is None:
                raise _unfit(key.label, "no certificate of that name is in the token")
            loaded = (loader.signing_cert, *loader.cert_registry)
            certificates = chain_of([load_der_x509_certificate(one.dump()) for one in loaded])
            above = map(translate_pyca_cryptography_cert_to_asn1, certificates[1:])
            signer = PKCS11Signer(session, cert_label=key.name, key_label=key.name, ca_chain=list(above))
            asyncio.run(signer.ensure_objects_loaded())
            signer.use_raw_mechanism = loader.signing_cert.public_key.algorithm == "ec"  # many tokens hash for RSA only
            yield Signatory(signer, tuple(certificates))
    except pkcs11.exceptions.PKCS11Error as error:
        raise _unfit(key.label, str(error) or type(error).__name__) from error


def _check(signatory: Signatory, where: str) -> None:
    """Raise Refused `signing_key` if the certificate is not valid now, or verifiers would reject its key."""
    certificate = signatory.certificates[0]
    for why in unfit_for_documents(certificate):
        raise _unfit(where, why)
    if not certificate.not_valid_before_utc <= datetime.now(UTC) <= certificate.not_valid_after_utc:
        days = f"{certificate.not_valid_before_utc:%Y-%m-%d} to {certificate.not_valid_after_utc:%Y-%m-%d}"
        raise _unfit(where, f"its certificate is valid from {days}, not now")


def _unfit(where: str, why: str) -> Refused:
    return Refused("signing_key", f"{where} cannot sign: {why}", REMEDY)
