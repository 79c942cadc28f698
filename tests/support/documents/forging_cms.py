"""Tools to forge the container of a PDF's signature (CMS): certificates, lists and stamps that it does not protect."""

from collections.abc import Callable
from typing import Any

from asn1crypto import algos, cms, parser
from asn1crypto import x509 as asn1
from asn1crypto.core import UTF8String
from cryptography.hazmat.primitives.serialization import Encoding

from support.documents.signing import Holder, holder, revocation_list

Forgery = Callable[[bytes], bytes]


def change_container(change: Callable[[Any, Any], object]) -> Forgery:
    """Replace the signature's container: `change` gets its content and its one SignerInfo."""

    def forge(content: bytes) -> bytes:
        begin = content.index(b"/Contents <") + 11
        end = content.index(b">", begin)
        contents = bytes.fromhex(content[begin:end].decode())
        container = cms.ContentInfo.load(contents[: parser.peek(contents)])
        change(container["content"], container["content"]["signer_infos"][0])
        replacement: bytes = container.dump(force=True).hex().encode()
        assert len(replacement) <= end - begin
        return content[:begin] + replacement.ljust(end - begin, b"0") + content[end:]

    return forge


def certificate_added(make_holder: Callable[[], Holder]) -> Forgery:
    def change(signed: Any, _: Any) -> None:
        der = make_holder().chain[0].public_bytes(Encoding.DER)
        signed["certificates"] = [
            *signed["certificates"],
            cms.CertificateChoices("certificate", asn1.Certificate.load(der)),
        ]

    return change_container(change)


def certificate_altered(signed: Any, _: Any) -> None:
    """Change the first valid day of the authority's certificate, which no signature of a document covers."""
    altered = []
    for choice in signed["certificates"]:
        der = choice.chosen.dump()
        if choice.chosen.ca:
            begin = der.index(b"Z\x17\r") - 12
            der = der[:begin] + b"20" + der[begin + 2 :]
        altered.append(cms.CertificateChoices("certificate", asn1.Certificate.load(der)))
    signed["certificates"] = altered


def server_altered(stamped: Any, _: Any) -> None:
    """Insert before the time server's certificate a second one of the same number, with another first day."""
    (certificate,) = {choice.chosen.dump() for choice in stamped["certificates"] if not choice.chosen.ca}
    begin = certificate.index(b"0\x1e\x17\r") + 4
    other = certificate[:begin] + b"20" + certificate[begin + 2 :]
    stamped["certificates"] = [
        cms.CertificateChoices("certificate", asn1.Certificate.load(der)) for der in (other, certificate)
    ]


def lists_added(signed: Any, _: Any) -> None:
    from asn1crypto import crl, pem

    der = pem.unarmor(revocation_list(holder("Authority")))[2]  # pyrefly: ignore[bad-index]  # one block, no generator of several
    signed["crls"] = [cms.RevocationInfoChoice("crl", crl.CertificateList.load(der))]


def add_unsigned(_: Any, info: Any) -> None:
    signing_time = cms.CMSAttribute({"type": "signing_time", "values": [cms.Time("utc_time", "200101000000Z")]})
    info["unsigned_attrs"] = [*(info["unsigned_attrs"] or ()), signing_time]


def stamp_by_stranger(signed: Any, info: Any) -> None:
    """Replace the time stamp by one of another time server."""
    import asyncio
    from hashlib import sha256

    from asn1crypto import keys
    from cryptography.hazmat.primitives.serialization import NoEncryption, PrivateFormat
    from pyhanko.sign.timestamps import DummyTimeStamper
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    from support.documents.signing import stamping

    del signed
    by = stamping("Time server", holder("Authority"))
    store = SimpleCertificateStore()
    private = keys.PrivateKeyInfo.load(by.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption()))
    signer, authority = (asn1.Certificate.load(link.public_bytes(Encoding.DER)) for link in by.chain)
    store.register_multiple([authority])
    stamper = DummyTimeStamper(tsa_cert=signer, tsa_key=private, certs_to_embed=store)
    digest = sha256(info["signature"].native).digest()
    token = asyncio.run(stamper.async_timestamp(digest, "sha256"))
    info["unsigned_attrs"] = [cms.CMSAttribute({"type": "signature_time_stamp_token", "values": [token]})]


def stamp_doubled(_: Any, info: Any) -> None:
    (stamp,) = info["unsigned_attrs"]
    twice = [*stamp["values"], cms.ContentInfo({"content_type": "data", "content": b"k = 1 1 1"})]
    info["unsigned_attrs"] = [cms.CMSAttribute({"type": "signature_time_stamp_token", "values": twice})]


def change_stamp(change: Callable[[Any, Any], object]) -> Callable[[Any, Any], None]:
    def altered(_: Any, info: Any) -> None:
        content = info["unsigned_attrs"][0]["values"][0]["content"]
        change(content, content["signer_infos"][0])

    return altered


def signer_doubled(signed: Any, info: Any) -> None:
    other = info.copy()
    del other["unsigned_attrs"]
    signed["signer_infos"] = [info, other]


def digests_more(signed: Any, _: Any) -> None:
    signed["digest_algorithms"] = [*signed["digest_algorithms"], algos.DigestAlgorithm({"algorithm": "sha1"})]


def parameters_more(_: Any, info: Any) -> None:
    name = info["signature_algorithm"]["algorithm"].native
    info["signature_algorithm"] = algos.SignedDigestAlgorithm({"algorithm": name})
    info["signature_algorithm"]["parameters"] = UTF8String("k = 1 1 1")
