"""Signed certificates: other programs find them valid, and whatever is altered afterwards is refused by its name."""

import io
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree

from rig.cli import main
from rig.data.result_file import write_result
from rig.history.finished import finished_run
from rig.history.store import open_history
from rig.report.signatures.findings import untrusted
from support.certified import result
from support.dcc_rules import schema_faults
from support.kept_rows import forge
from support.paths import CONFIGS
from support.signing import PASSPHRASE, Holder, Key, holder, issued, revocation_list, time_server

DS = "{http://www.w3.org/2000/09/xmldsig#}"
# WeasyPrint does not close its colour profile.
pytestmark = pytest.mark.filterwarnings("ignore:.*sRGB2014.icc:pytest.PytestUnraisableExceptionWarning")
SIMULATED = "Simulated laboratory: no real item was calibrated"
PDF, XML, RESULT, PAGE = "certificate.pdf", "certificate.xml", "result.json", "certificate.html"


@dataclass(frozen=True)
class Laboratory:
    """A run folder whose certificate was signed once: with its history, its authority, and its time server's."""

    folder: Path
    history: Path
    root: Path
    stranger: Path

    def read(self, name: str) -> bytes:
        return (self.folder / name).read_bytes()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    base = tmp_path_factory.mktemp("signed")
    folder, history = base / "run", base / "history.sqlite"
    folder.mkdir()
    write_result(result(), folder)
    demo = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    (folder / "config.yaml").write_text(f"{demo}site: {{country: DE, laboratory: Ours}}\n", encoding="utf-8")
    with open_history(str(history)) as opened:
        opened.enter(finished_run(folder))
    authority = holder("Authority")
    laboratory, server = holder("Laboratory", authority), time_server_of(authority)
    (base / "root.pem").write_bytes(Holder(authority.key, authority.chain).certificates())
    with pytest.MonkeyPatch.context() as patch, time_server(server) as url:
        patch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
        patch.setenv("RIG_HISTORY", str(history))
        key = laboratory.p12(base / "key.p12")
        command = ["report", str(folder), "--pdf", "--dcc", "--sign", str(key), "--time-server", url]
        assert main(command) == 0
        stranger = holder("Laboratory", holder("Authority")).p12(base / "stranger.p12")
        assert main([*command[:4], "--sign", str(stranger), "--out", str(base / "stranger"), "--history", "off"]) == 0
    yield Laboratory(folder, history, base / "root.pem", base / "stranger")


def time_server_of(authority: Holder) -> Holder:
    return issued("Time server", rsa.generate_private_key(65537, 2048), authority, stamps=True)


@pytest.fixture
def lab(made: Laboratory, tmp_path: Path) -> Laboratory:
    """A copy of one's own."""
    folder = tmp_path / "run"
    shutil.copytree(made.folder, folder)
    shutil.copy(made.history, tmp_path / "history.sqlite")
    return Laboratory(folder, tmp_path / "history.sqlite", made.root, made.stranger)


def verified(lab: Laboratory, *names: str, history: bool = True, trust: bool = True) -> tuple[int, str]:
    command = ["verify", *(str(lab.folder / name) for name in names), "--json"]
    command += ["--history", str(lab.history)] if history else []
    command += ["--trust", str(lab.root)] if trust else []
    with pytest.MonkeyPatch.context() as patch:
        out = io.StringIO()
        patch.setattr("sys.stdout", out)
        status = main(command)
    return status, out.getvalue()


def names_of(said: str) -> list[str]:
    return [problem["name"] for each in json.loads(said)["files"] for problem in each["problems"]]


@pytest.mark.slow
def test_what_was_signed_is_whole_and_says_who_when_and_that_it_is_simulated(lab: Laboratory) -> None:
    status, said = verified(lab, PDF, XML, RESULT, PAGE)
    assert (status, names_of(said)) == (0, []), said
    pdf, xml, beside, page = json.loads(said)["files"]
    (by,), (also_by,) = pdf["signatures"], xml["signatures"]
    assert by["signer"] == also_by["signer"] == "CN=Laboratory" and by["time_server"] == "CN=Time server"
    assert by["trusted"] is True and also_by["trusted"] is True and also_by["time_server"] is None
    assert by["reason"].startswith(SIMULATED) and also_by["reason"] == by["reason"]
    assert re.search(r"journal entry \d+, SHA-256 [0-9a-f]{64}$", by["reason"])
    assert beside["attached_to"] == PDF and page["attached_to"] is None
    assert all("RIG-" in " ".join(each["history"]) for each in (pdf, xml, page)) and beside["history"]


@pytest.mark.slow
def test_it_is_told_in_words_and_nobody_is_trusted_unasked(lab: Laboratory, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(lab.folder / PDF)]) == 0
    said = capsys.readouterr().out
    assert f"{lab.folder / PDF}: whole" in said and "signed by CN=Laboratory, 20" in said
    assert "the signer's own clock" in said, "a time server that nobody trusts tells no time"
    assert "compare yourself, or give --trust" in said and SIMULATED in said
    assert main(["verify", str(lab.folder / PAGE)]) == 1
    assert "not_signed" in capsys.readouterr().out
    assert main(["verify", str(lab.folder / "none.pdf")]) == 2
    assert "verify_file" in capsys.readouterr().err
    assert main(["verify", str(lab.folder / PDF), "--history", str(lab.folder / "none.sqlite")]) == 2
    assert "history_unreachable" in capsys.readouterr().err and not (lab.folder / "none.sqlite").exists()


def pdfsig(file: Path) -> str:
    command = ["pdfsig", "-nocert", str(file)]
    said: str = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    return said


@pytest.mark.slow
def test_other_programs_find_the_signatures_valid_and_those_of_altered_files_not(lab: Laboratory) -> None:
    said = pdfsig(lab.folder / PDF)
    assert "Signature is Valid" in said and "Total document signed" in said
    assert "ETSI.CAdES.detached" in said
    (lab.folder / "altered.pdf").write_bytes(flipped(b"stream\n", 40)(lab.read(PDF)))
    said = pdfsig(lab.folder / "altered.pdf")
    assert "Digest Mismatch" in said and "Signature is Valid" not in said
    altered = lab.folder / "altered.xml"
    altered.write_bytes(lab.read(XML).replace(b">false<", b">true<", 1))
    for file, status in ((XML, 0), (altered.name, 1)):
        ids = [
            "--id-attr:Id",
            "http://uri.etsi.org/01903/v1.3.2#:SignedProperties",
            "--id-attr:Id",
            f"{DS[1:-1]}:KeyInfo",
        ]
        ended = subprocess.run(
            ["xmlsec1", "--verify", "--trusted-pem", lab.root, *ids, lab.folder / file],
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert (ended.returncode != 0) == bool(status), ended.stderr


@pytest.mark.slow
def test_a_signed_digital_certificate_is_one_by_its_schema(lab: Laboratory) -> None:
    assert schema_faults(lab.read(XML)) == []


@pytest.mark.slow
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
    with time_server(time_server_of(authority)) as url:
        assert main([*command, "--time-server", url]) == 0
    assert main(["verify", str(out / PDF), "--trust", str(tmp_path / "authority.pem")]) == 0
    assert "was not revoked at that time" in capsys.readouterr().out


def replaced(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    def alter(content: bytes) -> bytes:
        assert old in content
        return content.replace(old, new, 1)

    return alter


def flipped(of: bytes, further: int) -> Callable[[bytes], bytes]:
    """One bit, so many bytes behind the first `of`."""

    def alter(content: bytes) -> bytes:
        found = bytearray(content)
        found[content.index(of) + further] ^= 1
        return bytes(found)

    return alter


def hex_changed(content: bytes, place: int) -> bytes:
    digit = b"0" if content[place : place + 1] != b"0" else b"1"
    return content[:place] + digit + content[place + 1 :]


def signature_changed(content: bytes) -> bytes:
    """Its value, which lies among certificates and a time stamp."""
    from pyhanko.pdf_utils.reader import PdfFileReader

    (signature,) = PdfFileReader(io.BytesIO(content)).embedded_signatures
    value = signature.signer_info["signature"].native.hex().encode()
    found = value if value in content else value.upper()
    return hex_changed(content, content.index(found) + 20)


def padding_changed(content: bytes) -> bytes:
    return hex_changed(content, content.index(b">", content.index(b"/Contents <")) - 2)


def updated(content: bytes) -> bytes:
    """An incremental update, as an editor makes one."""
    from pyhanko.pdf_utils.generic import TextStringObject, pdf_name
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter

    writer = IncrementalPdfFileWriter(io.BytesIO(content))
    writer.root[pdf_name("/Lang")] = TextStringObject("de")
    writer.update_root()
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def without_signature(content: bytes) -> bytes:
    return content[: content.index(b"%%EOF") + 6]


OF_PDF: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "a byte of a page": (flipped(b"stream\n", 40), "not_as_signed"),
    "a byte of an attachment": (flipped(b"/EmbeddedFile", 120), "not_as_signed"),
    "the version": (replaced(b"%PDF-1.7", b"%PDF-1.6"), "not_as_signed"),
    "the reason": (replaced(b"(Simulated", b"(Different"), "not_as_signed"),
    "the day": (replaced(rb"/M (D\07220", rb"/M (D\07219"), "not_as_signed"),
    "what is signed of it": (replaced(b"/ByteRange [0 ", b"/ByteRange [1 "), "not_as_signed"),
    "its signature": (signature_changed, "not_as_signed"),
    "what follows its signature": (padding_changed, "not_as_signed"),
    "bytes at its end": (lambda content: content + b"\n% better\n", "not_as_signed"),
    "an update by an editor": (updated, "not_as_signed"),
    "its end": (lambda content: content[:-40], "not_as_signed"),
    "all but the signature": (without_signature, "not_signed"),
}


def commented(content: bytes) -> bytes:
    return re.sub(rb"(<si:valueXMLList>\d)", rb"\1<!-- -->", content, count=1)


def element(path: str, change: Callable[[etree._Element], None]) -> Callable[[bytes], bytes]:
    def alter(content: bytes) -> bytes:
        root = etree.fromstring(content)
        (found, *_) = root.iterfind(path)
        change(found)
        return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))

    return alter


def removed(found: etree._Element) -> None:
    found.getparent().remove(found)


def first_last(found: etree._Element) -> None:
    found.append(found[0])


def of_another(found: etree._Element) -> None:
    stranger = holder("Laboratory", holder("Authority")).certificates().decode()
    found.text = stranger.split("-----")[2]


def text(new: str) -> Callable[[etree._Element], None]:
    def change(found: etree._Element) -> None:
        assert found.text != new
        found.text = new

    return change


def wrapped(content: bytes) -> bytes:
    """What was signed is moved aside, under a name, and something else stands in its place."""
    root = etree.fromstring(content)
    signature = root.find(f"{DS}Signature")
    signature.getparent().remove(signature)
    aside = etree.fromstring(etree.tostring(root))
    aside.set("Id", "aside")
    etree.SubElement(signature, f"{DS}Object").append(aside)
    signature.find(f"{DS}SignedInfo/{DS}Reference").set("URI", "#aside")
    value = next(root.iter("{https://ptb.de/si}valueXMLList"))
    value.text = "1 1 1"
    root.append(signature)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))


def typed(content: bytes) -> bytes:
    head, _, rest = content.partition(b"?>")
    return head + b'?><!DOCTYPE x [<!ENTITY e "1">]>' + rest


def styled(content: bytes) -> bytes:
    head, _, rest = content.partition(b"?>")
    return head + b'?><?xml-stylesheet href="other.xsl"?>' + rest


XADES = ".//{http://uri.etsi.org/01903/v1.3.2#}"
OF_XML: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "a value": (element(".//{https://ptb.de/si}valueXMLList", text("1 1 1")), "not_as_signed"),
    "an uncertainty": (element(".//{https://ptb.de/si}uncertaintyXMLList", text("0 0 0")), "not_as_signed"),
    "the number": (element(".//{https://ptb.de/dcc}uniqueIdentifier", text("RIG-1")), "not_as_signed"),
    "that it is valid": (replaced(b"valid>false<", b"valid>true<"), "not_as_signed"),
    "that it is simulated": (element(".//{https://ptb.de/dcc}statement", removed), "not_as_signed"),
    "an order": (element(".//{https://ptb.de/dcc}statements", first_last), "not_as_signed"),
    "a comment in a value": (commented, "not_as_signed"),
    "a style sheet": (styled, "not_as_signed"),
    "a document type": (typed, "not_as_signed"),
    "the reason": (element(f"{XADES}Description", text("A calibration certificate")), "not_as_signed"),
    "the time": (element(f"{XADES}SigningTime", text("2020-01-01T00:00:00+00:00")), "not_as_signed"),
    "the signature's value": (element(f".//{DS}SignatureValue", text("QUJD" * 22)), "not_as_signed"),
    "a digest": (element(f".//{DS}DigestValue", text("QUJD" * 11)), "not_as_signed"),
    "the signer's certificate": (element(f".//{DS}X509Certificate", of_another), "not_as_signed"),
    "what is signed moved aside": (wrapped, "not_as_signed"),
    "all but the signature": (element(f"{DS}Signature", removed), "not_signed"),
    "no XML any more": (lambda content: content[:-30], "not_as_signed"),
}


@pytest.mark.parametrize("what", OF_PDF)
def test_an_alteration_of_the_pdf_is_refused_by_name(what: str, lab: Laboratory) -> None:
    alter, name = OF_PDF[what]
    _altered_alone(lab, PDF, alter, name)


@pytest.mark.parametrize("what", OF_XML)
def test_an_alteration_of_the_digital_certificate_is_refused_by_name(what: str, lab: Laboratory) -> None:
    alter, name = OF_XML[what]
    _altered_alone(lab, XML, alter, name)


def _altered_alone(lab: Laboratory, file: str, alter: Callable[[bytes], bytes], name: str) -> None:
    before = lab.read(file)
    (lab.folder / file).write_bytes(alter(before))
    assert lab.read(file) != before
    status, said = verified(lab, file, history=False)
    assert status == 1 and set(names_of(said)) == {name}, said
    assert names_of(verified(lab, file)[1])[-1] == "unknown_to_history"


@pytest.mark.parametrize("file", [PDF, XML])
def test_one_signed_by_a_stranger_of_the_same_name_is_refused(file: str, lab: Laboratory) -> None:
    shutil.copy(lab.stranger / file, lab.folder / file)
    status, said = verified(lab, file)
    assert status == 1 and names_of(said) == ["signer_not_trusted", "unknown_to_history"], said
    assert verified(lab, file, history=False, trust=False)[0] == 0, "whole it is, and nobody said whom to trust"


@pytest.mark.parametrize(
    "alter",
    [
        replaced(b'"verdict": "pass"', b'"verdict": "fail"'),
        replaced(b'"serial_number": "', b'"serial_number": "X'),
        lambda content: re.sub(rb'("scale": \[\s*)\d', rb"\g<1>7", content, count=1),
        lambda content: content + b"\n",
        lambda content: b"{}",
    ],
    ids=["verdict", "serial number", "scale factor", "a line", "everything"],
)
def test_an_alteration_of_the_result_is_refused_by_name(alter: Callable[[bytes], bytes], lab: Laboratory) -> None:
    before = lab.read(RESULT)
    (lab.folder / RESULT).write_bytes(alter(before))
    assert lab.read(RESULT) != before
    status, said = verified(lab, PDF, RESULT, history=False)
    assert status == 1 and names_of(said) == ["not_as_signed"] and "another is attached" in said
    assert names_of(verified(lab, RESULT, history=False)[1]) == ["not_signed"]


def test_two_certificates_at_once_are_each_beside_their_own_result(lab: Laboratory) -> None:
    shutil.copytree(lab.folder, lab.folder / "other")
    (lab.folder / "other" / RESULT).write_bytes(b"{}")
    shutil.copy(lab.stranger / PDF, lab.folder / "other" / PDF)
    status, said = verified(lab, PDF, RESULT, f"other/{PDF}", history=False, trust=False)
    assert (status, names_of(said)) == (0, []), said


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
    status, said = verified(lab, PDF)
    assert status == 1 and name in names_of(said), said
    assert verified(lab, PDF, history=False)[0] == 0
    assert main(["history", "verify", "--history", str(lab.history)]) == 1


def test_one_of_an_unsigned_run_is_known_by_the_history_alone(lab: Laboratory) -> None:
    status, said = verified(lab, PAGE, RESULT)
    assert status == 0 and names_of(said) == [], said


@pytest.mark.parametrize("form", ["p12", "pem", "open pem"])
def test_keys_come_from_files_under_a_passphrase_of_the_environment(
    form: str, lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    key = issued("Laboratory", rsa.generate_private_key(65537, 2048), holder("Authority"))
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
    assert verified(lab, XML, history=False, trust=False)[0] == 0


@pytest.mark.slow
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
        key = issued(f"Laboratory, {label}", private, holder("Authority"))
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
        status, said = verified(lab, PDF, XML, history=False, trust=False)
        assert status == 0 and said.count(f'"signer": "CN=Laboratory\\\\, {label}"') == 2, said


def softhsm(*arguments: str) -> None:
    subprocess.run(["softhsm2-util", *arguments], check=True, capture_output=True, timeout=60)


def test_what_cannot_be_signed_is_refused_before_anything_is_written(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    out = ["--out", str(lab.folder / "new"), "--history", "off"]
    old = holder("Laboratory", holder("Authority"), days=(-9, -2)).p12(lab.folder / "old.p12")
    for key in (old, lab.root, lab.folder / RESULT, lab.folder / "none"):
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
        assert untrusted([own, root], [other, trust], now) == ""
        for later in (timedelta(days=31), timedelta(days=-2)):
            assert "the certificate is valid from" in untrusted([own], [trust], now + later)
    assert untrusted([own, root], [other], now) and untrusted([root], [root], now) == ""


@pytest.mark.slow
def test_a_time_server_that_gives_none_leaves_out_the_pdf_alone(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
    authority = holder("Authority")
    key, out = holder("Laboratory", authority).p12(lab.folder / "key.p12"), lab.folder / "new"
    with time_server(time_server_of(authority), [b"no time"]) as url:
        for server in (url, "http://127.0.0.1:1/"):
            command = ["report", str(lab.folder), "--pdf", "--dcc", "--sign", str(key), "--time-server", server]
            assert main([*command, "--out", str(out), "--history", "off"]) == 2
            assert "left out: time_server" in capsys.readouterr().err
    assert (out / XML).exists() and not (out / PDF).exists()
