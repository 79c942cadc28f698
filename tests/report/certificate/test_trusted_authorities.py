"""Authorities and time servers of a signature: who may vouch for a signer of documents, and for its time."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from rig.report.signatures.trust import Trust, unfit_for_stamps, why_untrusted
from support.documents.signing import Holder, issue

NOW = datetime.now(UTC)
MAIL, WEB, STAMPS = (
    ExtendedKeyUsageOID.EMAIL_PROTECTION,
    ExtendedKeyUsageOID.SERVER_AUTH,
    ExtendedKeyUsageOID.TIME_STAMPING,
)


def key(curve: ec.EllipticCurve | None = None) -> ec.EllipticCurvePrivateKey:
    return ec.generate_private_key(curve or ec.SECP256R1())


def names(name: str) -> x509.NameConstraints:
    allowed = x509.DirectoryName(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)]))
    return x509.NameConstraints(permitted_subtrees=[allowed], excluded_subtrees=None)


def below(above: Holder, **limits: object) -> Holder:
    """Return an authority below another."""
    return issue("Between", key(), above, is_authority=True, **limits)  # pyrefly: ignore[bad-argument-type]


def why(signer: Holder, trusted: Holder, moment: datetime = NOW) -> str:
    chain = [one.public_bytes(Encoding.DER) for one in signer.chain]
    return why_untrusted(chain, Trust((trusted.chain[0].public_bytes(Encoding.DER),)), moment)


ROOTS: dict[str, Callable[[], Holder]] = {
    "plain": lambda: issue("Root", key()),
    "one below it": lambda: issue("Root", key(), path_length=1),
    "of these names": lambda: issue("Root", key(), names=names("Laboratory")),
    "for e-mail": lambda: issue("Root", key(), purposes=[MAIL]),
}
UNFIT_ROOTS: dict[str, Callable[[], Holder]] = {
    "nobody below it": lambda: issue("Root", key(), path_length=0),
    "of other names": lambda: issue("Root", key(), names=names("Other")),
    "for web servers": lambda: issue("Root", key(), purposes=[WEB]),
    "expired": lambda: issue("Root", key(), days=(-9, -1)),
    "weak": lambda: issue("Root", key(ec.SECP192R1())),
}


@pytest.mark.parametrize("root", ROOTS)
def test_an_authority_vouches_for_a_signer_through_another(root: str) -> None:
    trusted = ROOTS[root]()
    signer = issue("Laboratory", key(), issue("Laboratory", key(), trusted, is_authority=True, purposes=[MAIL]))
    assert why(signer, trusted) == ""


@pytest.mark.parametrize("root", UNFIT_ROOTS)
def test_the_limits_of_a_trusted_authority_hold(root: str) -> None:
    trusted = UNFIT_ROOTS[root]()
    assert why(issue("Laboratory", key(), below(trusted)), trusted)


@pytest.mark.parametrize(
    "limits", [{"purposes": [WEB]}, {"usage": ["digital_signature"]}, {"is_authority": False}, {"days": (-9, -1)}]
)
def test_an_authority_in_between_must_be_one_for_documents(limits: dict[str, object]) -> None:
    root = ROOTS["plain"]()
    between = issue("Between", key(), root, **{"is_authority": True} | limits)  # pyrefly: ignore[bad-argument-type]
    assert why(issue("Laboratory", key(), between), root)


def test_a_trusted_signer_is_no_authority_and_is_trusted_by_its_own_certificate() -> None:
    signer = issue("Laboratory", key(), issue("Root", key()))
    assert why(signer, signer) == ""
    assert why(issue("Other", key(), signer), signer) == "it was issued by CN=Laboratory, who is no authority"
    anew = issue("Laboratory", signer.key, is_authority=False, days=(-1, 900))
    assert why(anew, signer) == "another certificate of the same name and key is the trusted one"


@pytest.mark.parametrize(
    ("purposes", "is_critical", "days", "fits"),
    [
        ([STAMPS], True, 0, True),
        ([STAMPS, MAIL], True, 0, False),
        ([STAMPS], False, 0, False),
        ([], True, 0, False),
        ([STAMPS], True, -5, False),
        ([STAMPS], True, 5, False),
    ],
)
def test_a_time_server_stamps_for_nothing_else_and_not_before_its_certificate_or_in_the_future(
    purposes: list[x509.ObjectIdentifier], is_critical: bool, days: int, fits: bool
) -> None:
    server = issue("Server", key(), issue("Root", key()), purposes=purposes, is_critical=is_critical)
    assert [*unfit_for_stamps(server.chain[0], NOW + timedelta(days=days), NOW)] == [] or not fits
    assert fits or [*unfit_for_stamps(server.chain[0], NOW + timedelta(days=days), NOW)]
