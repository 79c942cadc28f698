"""Keys and certificates of a laboratory that is made up, and a time server: everything that signatures need."""

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
    """A key with its certificate and those above it."""

    key: Key
    chain: tuple[x509.Certificate, ...]

    def p12(self, file: Path) -> Path:
        """A PKCS#12 file under the passphrase."""
        sealed = BestAvailableEncryption(PASSPHRASE.encode())
        own, *others = self.chain
        file.write_bytes(pkcs12.serialize_key_and_certificates(b"laboratory", self.key, own, others, sealed))
        return file

    def pem(self, file: Path, *, sealed: bool = True) -> Path:
        """A PEM file of the key and its certificates."""
        how = BestAvailableEncryption(PASSPHRASE.encode()) if sealed else NoEncryption()
        file.write_bytes(self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, how) + self.certificates())
        return file

    def certificates(self) -> bytes:
        """Its own and those above, in PEM."""
        return b"".join(each.public_bytes(Encoding.PEM) for each in self.chain)


def holder(name: str, above: Holder | None = None, *, days: tuple[int, int] = (-1, 30)) -> Holder:
    """One whose certificate is valid from and to these days from now; by `above`, or its own authority."""
    return issued(name, ec.generate_private_key(ec.SECP256R1()), above, days=days)


def issued(
    name: str,
    key: Key,
    above: Holder | None = None,
    *,
    days: tuple[int, int] = (-1, 30),
    usage: Sequence[str] | None = None,
    purposes: Sequence[x509.ObjectIdentifier] = (),
) -> Holder:
    """Return the holder of this key, whose certificate has this key usage and these purposes (extended key usage).

    Without a `usage` it is that of who signs documents or, without one above, of an authority; an empty one is absent.
    """
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    issuer = subject if above is None else above.chain[0].subject
    begin, end = (datetime.now(UTC) + timedelta(days=each) for each in days)
    signs = above is not None
    if usage is None:
        usage = ("digital_signature", "content_commitment") if signs else ("key_cert_sign", "crl_sign")
    made = x509.CertificateBuilder(issuer, subject, key.public_key(), x509.random_serial_number(), begin, end)
    made = made.add_extension(x509.BasicConstraints(ca=not signs, path_length=None), critical=True)
    if usage:
        bits = x509.KeyUsage(**{bit: bit in usage for bit in USAGES})
        made = made.add_extension(bits, critical=True)
    if purposes:
        made = made.add_extension(x509.ExtendedKeyUsage(purposes), critical=True)
    certificate = made.sign(key if above is None else above.key, hashes.SHA256())
    return Holder(key, (certificate, *(() if above is None else above.chain)))


def stamping(name: str, above: Holder) -> Holder:
    """Return a time server's key with a certificate of that authority."""
    purposes = [ExtendedKeyUsageOID.TIME_STAMPING]
    return issued(name, rsa.generate_private_key(65537, 2048), above, purposes=purposes)


def signing_as(by: Holder) -> Signatory:
    """Return the signatory with this key, which nothing asks whether it may sign documents."""
    from asn1crypto import keys
    from asn1crypto import x509 as asn1
    from pyhanko.sign.signers import SimpleSigner
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    own, *above = (asn1.Certificate.load(each.public_bytes(Encoding.DER)) for each in by.chain)
    private = by.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption())
    known = SimpleCertificateStore()
    known.register_multiple(above)
    signer = SimpleSigner(signing_cert=own, signing_key=keys.PrivateKeyInfo.load(private), cert_registry=known)
    return Signatory(signer, by.chain)


def revocation_list(by: Holder, *revoked: Holder, days: tuple[int, int] = (-1, 7)) -> bytes:
    """The list of an authority, PEM, of those days from now: it has revoked these an hour before now."""
    begin, end = (datetime.now(UTC) + timedelta(days=each) for each in days)
    made = x509.CertificateRevocationListBuilder(by.chain[0].subject, last_update=begin, next_update=end)
    for each in revoked:
        entry = x509.RevokedCertificateBuilder(each.chain[0].serial_number, datetime.now(UTC) - timedelta(hours=1))
        made = made.add_revoked_certificate(entry.build())
    return made.sign(by.key, hashes.SHA256()).public_bytes(Encoding.PEM)


@contextmanager
def time_server(by: Holder, said: Sequence[bytes] = ()) -> Iterator[str]:
    """A server of RFC 3161 on loopback, its key RSA, by its URL; `said`, where there is any, is all it answers."""
    from asn1crypto import keys, tsp
    from asn1crypto import x509 as asn1
    from pyhanko.sign.timestamps import DummyTimeStamper
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    known = SimpleCertificateStore()
    known.register_multiple(asn1.Certificate.load(each.public_bytes(Encoding.DER)) for each in by.chain)
    private = keys.PrivateKeyInfo.load(by.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption()))
    own = asn1.Certificate.load(by.chain[0].public_bytes(Encoding.DER))
    stamper = DummyTimeStamper(tsa_cert=own, tsa_key=private, certs_to_embed=known)

    class Answers(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            asked = self.rfile.read(int(self.headers["Content-Length"]))
            answer = said[0] if said else stamper.request_tsa_response(tsp.TimeStampReq.load(asked)).dump()
            self.send_response(200)
            self.send_header("Content-Type", "application/timestamp-reply")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
