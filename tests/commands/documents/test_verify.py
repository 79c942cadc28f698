"""Signed certificates: other programs find them valid, and whatever is altered afterwards is refused by its name."""

import json
import re
import shutil
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID

from rig.cli import main
from rig.report.signatures.trust import Trust, why_untrusted
from support.documents.dcc_rules import schema_faults
from support.documents.forged_pdf import flip
from support.documents.signed_laboratory import PAGE, PDF, RESULT, XML, Laboratory, names_of
from support.documents.signing import PASSPHRASE, Key, holder, issue, revocation_list, stamping, time_server
from support.history.kept_rows import forge
from support.laboratories.commands import rig_here
from support.processes.waiting import PATIENCE_S

DS = "{http://www.w3.org/2000/09/xmldsig#}"
pytestmark = [
    pytest.mark.slow,  # to import what signs takes longer than the shortest of these tests
    # WeasyPrint does not close its colour profile.
    pytest.mark.filterwarnings("ignore:.*sRGB2014.icc:pytest.PytestUnraisableExceptionWarning"),
]
SIMULATED = "Simulated laboratory: no real item was calibrated"
ALTERED, NOBODY_TRUSTED = 1, 4


@pytest.fixture
def lab(made: Laboratory, tmp_path: Path) -> Laboratory:
    """A copy of one's own."""
    return made.copied(tmp_path)


def test_what_was_signed_is_whole_and_says_who_when_and_that_it_is_simulated(lab: Laboratory) -> None:
    status, said = lab.verified(PDF, XML, RESULT, PAGE)
    assert (status, names_of(said)) == (0, []), said
    pdf, xml, beside, page = json.loads(said)["files"]
    (by,), (also_by,) = pdf["signatures"], xml["signatures"]
    assert by["signer"] == also_by["signer"] == "CN=Laboratory" and by["time_server"] == "CN=Time server"
    assert by["trusted"] is True and also_by["trusted"] is True and also_by["time_server"] is None
    assert by["reason"].startswith(SIMULATED) and also_by["reason"] == by["reason"]
    assert re.search(r"journal entry \d+, SHA-256 [0-9a-f]{64}$", by["reason"])
    assert beside["attached_to"] == PDF and page["attached_to"] is None
    assert all("RIG-" in " ".join(each["history"]) for each in (pdf, xml, page)) and beside["history"]


def test_it_is_told_in_words_and_nobody_is_trusted_unasked(lab: Laboratory, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(lab.folder / PDF)]) == NOBODY_TRUSTED
    said = capsys.readouterr().out
    assert f"{lab.folder / PDF}: NOT SIGNED BY A TRUSTED SIGNER" in said and "signed by CN=Laboratory, 20" in said
    assert "the signer's own clock" in said, "a time server that nobody trusts tells no time"
    assert "yourself, or give --trust" in said and SIMULATED in said
    assert "signer_unknown" in said
    assert main(["verify", str(lab.folder / PAGE)]) == NOBODY_TRUSTED
    assert "not_signed" in capsys.readouterr().out
    assert main(["verify", str(lab.folder / PDF), "--signer", "Laboratory"]) == 2
    assert "bad_option" in capsys.readouterr().err
    assert main(["verify", str(lab.folder / "none.pdf")]) == 2
    assert "verify_file" in capsys.readouterr().err
    assert main(["verify", str(lab.folder / PDF), "--history", str(lab.folder / "none.sqlite")]) == 2
    assert "history_unreachable" in capsys.readouterr().err and not (lab.folder / "none.sqlite").exists()


def pdfsig(file: Path) -> str:
    command = ["pdfsig", "-nocert", str(file)]
    said: str = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout
    return said


def test_other_programs_find_the_signatures_valid_and_those_of_altered_files_not(lab: Laboratory) -> None:
    said = pdfsig(lab.folder / PDF)
    assert "Signature is Valid" in said and "Total document signed" in said
    assert "ETSI.CAdES.detached" in said
    (lab.folder / "altered.pdf").write_bytes(flip(b"stream\n", 40)(lab.read(PDF)))
    said = pdfsig(lab.folder / "altered.pdf")
    assert "Digest Mismatch" in said and "Signature is Valid" not in said
    content = lab.read(XML)
    (lab.folder / "altered.xml").write_bytes(content.replace(b">false<", b">true<", 1))
    (lab.folder / "utf-16.xml").write_bytes(content.decode().replace("UTF-8", "UTF-16", 1).encode("utf-16"))
    for file, status in ((XML, 0), ("utf-16.xml", 0), ("altered.xml", 1)):
        assert bool(lab.verified(file, history=False)[0]) == bool(status)
        ids = [
            "--id-attr:Id",
            "http://uri.etsi.org/01903/v1.3.2#:SignedProperties",
            "--id-attr:Id",
            f"{DS[1:-1]}:KeyInfo",
        ]
        ended = subprocess.run(
            ["xmlsec1", "--verify", "--trusted-pem", lab.root, *ids, lab.folder / file],
            capture_output=True, text=True, timeout=PATIENCE_S, check=False,
        )  # fmt: skip
        assert (ended.returncode != 0) == bool(status), ended.stderr


def test_a_signed_digital_certificate_is_one_by_its_schema(lab: Laboratory) -> None:
    assert schema_faults(lab.read(XML)) == []


@pytest.mark.thorough
def test_with_revocation_lists_it_can_be_checked_long_after(
    lab: Laboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    authority, out = holder("Authority"), tmp_path / "long"
    (tmp_path / "authority.pem").write_bytes(revocation_list(authority) + authority.certificates())
    key = holder("Laboratory", authority).p12(tmp_path / "key.p12")
    command = ["report", str(lab.folder), "--pdf", "--sign", str(key), "--history", "off", "--out", str(out)]
    command += ["--long-term", str(tmp_path / "authority.pem")]
    assert main(command) == 2 and "bad_option" in capsys.readouterr().err and not out.exists()
    with time_server(stamping("Time server", authority)) as url:
        assert main([*command, "--time-server", url]) == 0
    assert main(["verify", str(out / PDF), "--trust", str(tmp_path / "authority.pem")]) == 0
    assert "was not revoked at that time" in capsys.readouterr().out


@pytest.mark.parametrize("file", [PDF, XML])
def test_one_signed_by_a_stranger_of_the_same_name_is_refused(file: str, lab: Laboratory) -> None:
    shutil.copy(lab.stranger / file, lab.folder / file)
    status, said = lab.verified(file)
    assert status == ALTERED and names_of(said)[-1] == "unknown_to_history", said
    assert set(names_of(said)) == {"signer_not_trusted", "unknown_to_history"}
    for trust, name in ((True, "signer_not_trusted"), (False, "signer_unknown")):
        status, said = lab.verified(file, history=False, trust=trust)
        assert status == NOBODY_TRUSTED and set(names_of(said)) == {name}, said


def test_two_certificates_at_once_are_each_beside_their_own_result(lab: Laboratory) -> None:
    shutil.copytree(lab.folder, lab.folder / "other")
    (lab.folder / "other" / RESULT).write_bytes(b"{}")
    shutil.copy(lab.stranger / PDF, lab.folder / "other" / PDF)
    status, said = lab.verified(PDF, RESULT, f"other/{PDF}", f"other/{RESULT}", history=False)
    assert status == ALTERED, said
    whole, beside, other, forged = (set(names_of(json.dumps({"files": [file]}))) for file in json.loads(said)["files"])
    assert whole == beside == set() and other == {"signer_not_trusted"} and forged == {"not_as_signed"}


@pytest.mark.parametrize(
    ("statements", "name"),
    [
        (["UPDATE certificate SET marks = ''"], "not_as_entered"),
        (["UPDATE certificate SET replaces = 'RIG-1'"], "not_as_entered"),
        (["UPDATE certificate_file SET entered_utc = '2020-01-01'"], "not_as_entered"),
        (["UPDATE run SET verdict = 'other'"], "not_as_entered"),
        (["UPDATE parameter SET value = 1 WHERE name = 'kx'"], "not_as_entered"),
        (["UPDATE calibration SET serial_number = 'G-9'"], "not_as_entered"),
        (["DELETE FROM journal WHERE kind = 'certificate'"], "not_as_entered"),
        (["DELETE FROM certificate_file"], "unknown_to_history"),
        (["UPDATE journal SET entered_utc = '2020-01-01' WHERE number = 1"], "journal_rewritten"),
        (["DELETE FROM journal WHERE number = 1"], "journal_rewritten"),
    ],
)
def test_an_alteration_of_the_history_is_refused_by_name(statements: list[str], name: str, lab: Laboratory) -> None:
    forge(str(lab.history), *statements)
    status, said = lab.verified(PDF)
    assert status == 1 and name in names_of(said), said
    assert lab.verified(PDF, history=False)[0] == 0
    assert main(["history", "verify", "--history", str(lab.history)]) == 1


def test_one_of_an_unsigned_run_is_known_by_the_history_alone(lab: Laboratory) -> None:
    status, said = lab.verified(PAGE, RESULT)
    assert status == 0 and names_of(said) == [], said


@pytest.mark.parametrize("form", ["p12", "pem", "open pem"])
def test_keys_come_from_files_under_a_passphrase_of_the_environment(
    form: str, lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    key = issue("Laboratory", rsa.generate_private_key(65537, 2048), holder("Authority"))
    file = lab.folder.parent / "key"
    _ = key.p12(file) if form == "p12" else key.pem(file, sealed=form == "pem")
    command = ["report", str(lab.folder), "--dcc", "--sign", str(file), "--history", "off"]
    if form != "open pem":
        for passphrase in (None, "another"):
            if passphrase is not None:
                monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", passphrase)
            assert main(command) == 2
            assert "signing_key" in capsys.readouterr().err
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    assert main(command) == 0
    assert names_of(lab.verified(XML, history=False, trust=False)[1]) == ["signer_unknown"]


def test_a_key_in_a_token_signs_both(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import pkcs11
    from pkcs11.util.x509 import decode_x509_certificate

    base, pin = lab.folder.parent, ["--pin", "1234"]
    (base / "tokens").mkdir()
    (base / "softhsm2.conf").write_text(f"directories.tokendir = {base / 'tokens'}\n", encoding="utf-8")
    monkeypatch.setenv("SOFTHSM2_CONF", str(base / "softhsm2.conf"))
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", "1234")
    library = next(Path("/usr/lib").rglob("libsofthsm2.so"))
    softhsm("--init-token", "--free", "--label", "rig", *pin, "--so-pin", "1234")
    keys: dict[str, Key] = {"ec": ec.generate_private_key(ec.SECP256R1()), "rsa": rsa.generate_private_key(65537, 2048)}
    for number, (label, private) in enumerate(keys.items(), start=1):
        key = issue(f"Laboratory, {label}", private, holder("Authority"))
        file = key.pem(base / label, sealed=False)
        softhsm("--import", str(file), "--token", "rig", "--label", label, "--id", f"0{number}", *pin)
        with pkcs11.lib(str(library)).get_token(token_label="rig").open(rw=True, user_pin="1234") as session:
            stored = decode_x509_certificate(key.chain[0].public_bytes(Encoding.DER))
            session.create_object({**stored, pkcs11.Attribute.TOKEN: True, pkcs11.Attribute.LABEL: label})
    command = ["report", str(lab.folder), "--pdf", "--dcc", "--history", "off", "--sign"]
    for wrong in ("pkcs11:token=rig", f"pkcs11:token=rig;object=other?module-path={library}"):
        assert main([*command, wrong]) == 2
        assert "signing_key" in capsys.readouterr().err
    for label in keys:
        assert main([*command, f"pkcs11:token=rig;object={label}?module-path={library}"]) == 0
        status, said = lab.verified(PDF, XML, history=False, trust=False)
        assert status == NOBODY_TRUSTED and names_of(said) == ["signer_unknown"] * 2, said
        assert said.count(f'"signer": "CN=Laboratory\\\\, {label}"') == 2, said


def softhsm(*arguments: str) -> None:
    subprocess.run(["softhsm2-util", *arguments], check=True, capture_output=True, timeout=PATIENCE_S)


@pytest.mark.parametrize(
    "address",
    [
        "pkcs11:token=rig;object=key;pin-value=7391?module-path=/x",
        "pkcs11:pin-value=7391;token=rig;object=key?module-path=/x",
        "pkcs11:token=rig;object=key?module-path=/x&pin-value=7391",
        "pkcs11:token=rig;object=key?pin-value=7391&module-path=/x",
        "pkcs11:token=rig;object=key?module-path=/x;pin-value=7391",
        "pkcs11:token=rig;object=key?module-path=/x?pin-value=7391",
        "pkcs11:token=rig;object=key?module-path=/x#pin-value=7391",
        "pkcs11:token=rig;object=key?module-path=/x&PIN-Value=7391",
        "pkcs11:token=rig;object=key?module-path=/x&%70in%2Dvalue=7391",
        "pkcs11:token=rig;object=key?module-path=/x&%2570in-value=7391",
        "pkcs11:token=rig;object=key?module-path=/x%26pin-value%3D7391",
        "pkcs11:token=rig;object=key?module-path=/x&pin_value=7391",
        "pkcs11:token=rig;object=key?module-path=/x&pin=7391",
        "pkcs11:token=rig;object=key?module-path=/x&pin-source=file:/7391",
        "PKCS11:token=rig;object=key?module-path=/x&pin-value=7391",
        " pkcs11:token=rig;object=key?module-path=/x&pin-value=7391",
        "pkcs11%3Atoken=rig;object=key?module-path=/x&pin-value=7391",
        "pkcs11 :token=rig;object=key?module-path=/x&pin-value=7391",
        "file:pkcs11:token=rig;object=key?module-path=/x&pin-value=7391",
        "'pkcs11:token=rig;object=key?module-path=/x&pin-value=7391'",
        "pkcs11:token=rig;object=key?module-path=/x&x-secret=7391",
        "pkcs11:token=rig;object=key;type=7391?module-path=/x",
        "pkcs11:token=rig;object=key?module-path=/x&module-path=7391",
    ],
)
def test_an_address_of_a_token_with_a_pin_in_it_is_refused_and_not_repeated(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", "7391")
    ended = rig_here("report", tmp_path, "--sign", address, "--history", "off")
    assert ended.returncode == 2 and "signing_key" in ended.stderr and "RIG_SIGNING_PASSPHRASE" in ended.stderr
    assert "7391" not in ended.stderr + ended.stdout


def test_what_cannot_be_signed_is_refused_before_anything_is_written(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    out = ["--out", str(lab.folder / "new"), "--history", "off"]
    old = holder("Laboratory", holder("Authority"), days=(-9, -2)).p12(lab.folder / "old.p12")
    server = ec.generate_private_key(ec.SECP256R1()), holder("Authority")
    of_server = issue("Laboratory", *server, purposes=[ExtendedKeyUsageOID.SERVER_AUTH]).p12(lab.folder / "web.p12")
    for key in (old, of_server, lab.root, lab.folder / RESULT, lab.folder / "none"):
        assert main(["report", str(lab.folder), "--sign", str(key), *out]) == 2
        assert "signing_key" in capsys.readouterr().err
    assert main(["report", str(lab.folder), "--time-server", "http://127.0.0.1:1/", *out]) == 2
    assert "bad_option" in capsys.readouterr().err and not (lab.folder / "new").exists()
    monkeypatch.setitem(__import__("sys").modules, "pyhanko.sign", None)
    assert main(["report", str(lab.folder), "--sign", str(old), *out]) == 2
    assert "missing_extra" in capsys.readouterr().err


def test_a_certificate_is_trusted_itself_or_by_its_authority_while_it_is_valid() -> None:
    authority = holder("Authority")
    below = holder("Laboratory", authority)
    own, root, other = (each.chain[0].public_bytes(Encoding.DER) for each in (below, authority, holder("Authority")))
    now = datetime.now(UTC)
    for trust in (own, root):
        assert why_untrusted([own, root], Trust((other, trust)), now) == ""
        for later in (timedelta(days=31), timedelta(days=-2)):
            assert "the certificate is valid from" in why_untrusted([own], Trust((trust,)), now + later)
    assert "path could not be validated" in why_untrusted([own, root], Trust((other,)), now)
    assert "key usage" in why_untrusted([root], Trust((root,)), now), "an authority's key signs certificates"


@pytest.mark.proof
def test_a_time_server_that_gives_none_leaves_out_the_pdf_alone(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], thorough: bool
) -> None:
    """One that does not answer at all ends in the same place, and a page takes a second to draw: by `make proof`."""
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    authority = holder("Authority")
    key, out = holder("Laboratory", authority).p12(lab.folder / "key.p12"), lab.folder / "new"
    with time_server(stamping("Time server", authority), [b"no time"]) as url:
        for server in (url, "http://127.0.0.1:1/") if thorough else (url,):
            command = ["report", str(lab.folder), "--pdf", "--dcc", "--sign", str(key), "--time-server", server]
            assert main([*command, "--out", str(out), "--history", "off"]) == 2
            assert "left out: time_server" in capsys.readouterr().err
    assert (out / XML).exists() and not (out / PDF).exists()
