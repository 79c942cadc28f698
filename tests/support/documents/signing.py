"""Keys and certificates of an invented laboratory, and a time server, for signatures."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
    pkcs12,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from rig.report.signatures.signatory import Signatory

PASSPHRASE = "a passphrase"
USAGES = (
    *("digital_signature", "content_commitment", "key_encipherment", "data_encipherment", "key_agreement"),
    *("key_cert_sign", "crl_sign", "encipher_only", "decipher_only"),
)
Key = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey


@dataclass(frozen=True, slots=True)
class Holder:
    """A key with its certificate and the certificates of its issuers."""

    key: Key
    chain: tuple[x509.Certificate, ...]

    def p12(self, file: Path) -> Path:
        """Write a PKCS#12 file under the passphrase."""
        sealed = BestAvailableEncryption(PASSPHRASE.encode())
        certificate, *others = self.chain
        file.write_bytes(pkcs12.serialize_key_and_certificates(b"laboratory", self.key, certificate, others, sealed))
        return file

    def pem(self, file: Path, *, sealed: bool = True) -> Path:
        """Write a PEM file of the key and its certificates."""
        encryption = BestAvailableEncryption(PASSPHRASE.encode()) if sealed else NoEncryption()
        file.write_bytes(self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, encryption) + self.certificates())
        return file

    def certificates(self) -> bytes:
        """Return the certificate and those of its issuers, in PEM."""
        return b"".join(certificate.public_bytes(Encoding.PEM) for certificate in self.chain)


def holder(name: str, above: Holder | None = None, *, days: tuple[int, int] = (-1, 30)) -> Holder:
    """Return a holder whose certificate is valid for these days from now, issued by `above` or by itself."""
    return issue(name, ec.generate_private_key(ec.SECP256R1()), above, days=days)


def issue(
    name: str,
    key: Key,
    above: Holder | None = None,
    *,
    days: tuple[int, int] = (-1, 30),
    usage: Sequence[str] | None = None,
    purposes: Sequence[x509.ObjectIdentifier] = (),
    is_authority: bool | None = None,
    path_length: int | None = None,
    names: x509.NameConstraints | None = None,
    is_critical: bool = True,
) -> Holder:
    """Return the holder of this key, whose certificate has this key usage and these purposes (extended key usage).

    By default those without an issuer are authorities. The default `usage` is that of a document's signer or of an
    authority; an empty one is omitted. `path_length` and `names` are limits; `is_critical`: the purposes.
    """
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    issuer = subject if above is None else above.chain[0].subject
    begin, end = (datetime.now(UTC) + timedelta(days=day) for day in days)
    signs = above is not None if is_authority is None else not is_authority
    if usage is None:
        usage = ("digital_signature", "content_commitment") if signs else ("key_cert_sign", "crl_sign")
    builder = x509.CertificateBuilder(issuer, subject, key.public_key(), x509.random_serial_number(), begin, end)
    builder = builder.add_extension(x509.BasicConstraints(ca=not signs, path_length=path_length), critical=True)
    if usage:
        bits = x509.KeyUsage(**{bit: bit in usage for bit in USAGES})
        builder = builder.add_extension(bits, critical=True)
    if purposes:
        builder = builder.add_extension(x509.ExtendedKeyUsage(purposes), critical=is_critical)
    if names is not None:
        builder = builder.add_extension(names, critical=True)
    certificate = builder.sign(key if above is None else above.key, hashes.SHA256())
    return Holder(key, (certificate, *(() if above is None else above.chain)))


def stamping(name: str, above: Holder) -> Holder:
    """Return a time server's key with a certificate of that authority."""
    purposes = [ExtendedKeyUsageOID.TIME_STAMPING]
    return issue(name, rsa.generate_private_key(65537, 2048), above, purposes=purposes)


def signing_as(by: Holder) -> Signatory:
    """Return the signatory with this key, without a check that it may sign documents."""
    from asn1crypto import keys
    from asn1crypto import x509 as asn1
    from pyhanko.sign.signers import SimpleSigner
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    certificate, *above = (asn1.Certificate.load(link.public_bytes(Encoding.DER)) for link in by.chain)
    private = by.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption())
    store = SimpleCertificateStore()
    store.register_multiple(above)
    signer = SimpleSigner(signing_cert=certificate, signing_key=keys.PrivateKeyInfo.load(private), cert_registry=store)
    return Signatory(signer, by.chain)


def revocation_list(by: Holder, *revoked: Holder, days: tuple[int, int] = (-1, 7)) -> bytes:
    """Return an authority's revocation list in PEM, valid for these days: these holders were revoked an hour ago."""
    begin, end = (datetime.now(UTC) + timedelta(days=day) for day in days)
    builder = x509.CertificateRevocationListBuilder(by.chain[0].subject, last_update=begin, next_update=end)
    for holder in revoked:
        entry = x509.RevokedCertificateBuilder(holder.chain[0].serial_number, datetime.now(UTC) - timedelta(hours=1))
        builder = builder.add_revoked_certificate(entry.build())
    return builder.sign(by.key, hashes.SHA256()).public_bytes(Encoding.PEM)


@contextmanager
def time_server(by: Holder, answers: Sequence[bytes] = ()) -> Iterator[str]:
    """Serve RFC 3161 on loopback with an RSA key; yield its URL. `answers`, if any, replace its own."""
    from asn1crypto import keys, tsp
    from asn1crypto import x509 as asn1
    from pyhanko.sign.timestamps import DummyTimeStamper
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    store = SimpleCertificateStore()
    store.register_multiple(asn1.Certificate.load(link.public_bytes(Encoding.DER)) for link in by.chain)
    private = keys.PrivateKeyInfo.load(by.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption()))
    certificate = asn1.Certificate.load(by.chain[0].public_bytes(Encoding.DER))
    stamper = DummyTimeStamper(tsa_cert=certificate, tsa_key=private, certs_to_embed=store)

    class Answers(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            request = self.rfile.read(int(self.headers["Content-Length"]))
            answer = answers[0] if answers else stamper.request_tsa_response(tsp.TimeStampReq.load(request)).dump()
            self.send_response(200)
            self.send_header("Content-Type", "application/timestamp-reply")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
