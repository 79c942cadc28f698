"""`rig verify`: the signer and time of a certificate, whether it is unchanged, and whether it is in a history."""

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.config_arguments import add_json, parse_run, read_history_name
from rig.errors import Refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.history.entered_file import FileEntries
    from rig.report.signatures.findings import FileInspection, SignatureReport

SIZE_MAX_BYTES = 256_000_000
SCHEMA = "rig.verification/1"
ALTERED, UNTRUSTED = 1, 4
# Problems of a file that is unchanged, but whose signer is not trusted.
TRUST_PROBLEMS = {"not_signed", "signer_unknown", "signer_not_trusted"}
STATUSES = (
    "exit status: 0 every file is valid: unchanged, and signed by a signer that --trust and --signer accept, or "
    f"attached to such a file, or in the history that --history names; {ALTERED} a file is not valid: altered, or "
    f"the history contradicts it; {UNTRUSTED} no trusted signer has signed a file: not signed, signed by another, "
    "or there is no --trust; 2 there is no answer: a file or the history cannot be read"
)


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig verify`."""
    parser.epilog = STATUSES
    parser.add_argument(
        "files",
        nargs="+",
        type=parse_run,
        metavar="FILE",
        help="a signed certificate.pdf or certificate.xml, such as latest/certificate.pdf; with it, files attached to "
        "it, such as result.json",
    )
    parser.add_argument(
        "--trust",
        action="append",
        default=[],
        type=Path,
        metavar="CERTIFICATE",
        help="certificate of the laboratory's key, of its issuer, or of a time server: PEM or DER; may be repeated; "
        "the key's certificate must be issued for signing documents",
    )
    parser.add_argument(
        "--signer",
        metavar="NAME",
        help="the name that the key's certificate must have: its common name, or all of it, such as "
        "CN=Example,O=Laboratory",
    )
    parser.add_argument("--history", metavar="PLACE", help="check that the files are in this history, unchanged")
    add_json(parser)


@dataclass(frozen=True, slots=True)
class VerifiedFile:
    file: Path
    signatures: "tuple[SignatureReport, ...]"
    history: tuple[str, ...]
    attached_to: str | None
    problems: tuple[Refused, ...]


def run(options: Namespace) -> int:
    """Verify each file and print the findings; return 0, or the exit status that `--help` lists.

    Raise Refused `bad_option`, `verify_file`, and what `read_trusted_certificates`, `inspect_within_limits` and
    `open_history` raise.
    """
    from rig.report.signatures.inspection import read_trusted_certificates
    from rig.report.signatures.inspection_process import inspect_within_limits
    from rig.report.signatures.trust import Trust

    if options.signer is not None and not options.trust:
        what = "--signer names the holder of a certificate, but no --trust names the authority that issued it"
        raise Refused("bad_option", what, "Give --trust CERTIFICATE too, or leave it out")
    trust = Trust(read_trusted_certificates(options.trust), options.signer)
    contents = {file: _read_content(file) for file in options.files}
    looks = {file: inspect_within_limits(file, content, trust) for file, content in contents.items()}
    named = read_history_name(options.history)
    history_answers = {} if named is None else _look_up(named, contents, looks)
    files = [_judge(file, contents[file], looks, history_answers.get(file)) for file in contents]
    if options.json:
        print(json.dumps({"schema": SCHEMA, "files": list(map(_entry, files))}, indent=2))
    else:
        for file in files:
            _print_file(file)
    problems = {problem.name for document in files for problem in document.problems}
    return ALTERED if problems - TRUST_PROBLEMS else UNTRUSTED if problems else 0


def _read_content(file: Path) -> bytes:
    from rig.config.files.regular_file import UnfitFile, read_regular_file

    try:
        return read_regular_file(file, SIZE_MAX_BYTES)
    except (UnfitFile, OSError) as error:
        why = getattr(error, "strerror", None) or error
        raise Refused("verify_file", f"{file} cannot be read: {why}", "Give the files of a certificate") from None


def _look_up(
    named: str, contents: Mapping[Path, bytes], looks: "Mapping[Path, FileInspection]"
) -> "dict[Path, FileEntries]":
    """Return the entries that the history `named` has of each file.

    Raise Refused `history_unreachable`, and what `open_history` raises.
    """
    from rig.commands.history.history_answer import await_answer
    from rig.history.entered_file import find_file_entries
    from rig.history.storage.address import resolve_address
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    address = resolve_address(named)
    if not is_there(address):  # opening it would create one
        raise Refused("history_unreachable", f"there is no history {address.label}", "Name another with --history")

    def ask() -> "dict[Path, FileEntries]":
        with open_history(address) as history:
            anchors = {
                file: next((seal.reason.anchor for seal in look.signatures if seal.reason.anchor), None)
                for file, look in looks.items()
            }
            return {
                file: find_file_entries(history, file.name, content, anchors[file])
                for file, content in contents.items()
            }

    return await_answer(ask)


def _judge(
    file: Path, content: bytes, looks: "Mapping[Path, FileInspection]", history_answer: "FileEntries | None"
) -> VerifiedFile:
    """Return the findings on a file: by its signature, or else by a signed file that contains it, and by the history.

    `looks` are the inspections of all files. An unsigned file that the history confirms needs no trusted signer.
    """
    look, attached_to = looks[file], None
    problems = look.problems
    if not look.signatures:
        attached_to, problems = find_signed_holder(file.name, content, look, looks)
        if history_answer is not None and not history_answer.problems:
            problems = tuple(problem for problem in problems if problem.name not in TRUST_PROBLEMS)
    history_words = () if history_answer is None else history_answer.entries
    return VerifiedFile(
        file,
        look.signatures,
        history_words,
        attached_to,
        (*problems, *(() if history_answer is None else history_answer.problems)),
    )


def find_signed_holder(
    name: str, content: bytes, look: "FileInspection", looks: "Mapping[Path, FileInspection]"
) -> tuple[str | None, tuple[Refused, ...]]:
    """Return the name of the signed file that contains an unsigned one, if any, and the problems of its signer.

    The unsigned file may be attached under its own or under another name.
    """
    from rig.report.signatures.findings import not_as_signed, not_attached

    named = {other: signed for other, signed in looks.items() if name in signed.attached}
    same = {other: name for other, signed in named.items() if signed.attached[name] == content}
    if not named:
        same = {
            other: attachment
            for other, signed in looks.items()
            for attachment in signed.attached
            if signed.attached[attachment] == content
        }
    if same:
        best = min(same, key=lambda other: len(looks[other].problems))
        return best.name if same[best] == name else f"{best.name} as {same[best]}", looks[best].problems
    if {problem.name for problem in look.problems} != {"not_signed"}:
        return None, look.problems
    if named:
        holders = ", ".join(dict.fromkeys(other.name for other in named))
        return None, (not_as_signed(name, f"another is attached to {holders}"),)
    searched = {other.name: tuple(signed.attached) for other, signed in looks.items() if signed.signatures}
    return None, (not_attached(name, searched),) if searched else look.problems


def _print_file(documents: VerifiedFile) -> None:
    say(f"{documents.file}: {_describe_state(documents.problems)}")
    for seal in documents.signatures:
        when = "at a time that it does not state" if seal.when is None else f"{seal.when:%Y-%m-%d %H:%M:%S %Z}"
        clock = "the signer's own clock" if seal.time_server is None else f"the time server {seal.time_server}"
        say(f"  signed by {seal.signer}, {when} by {clock}")
        say(f"  its certificate has SHA-256 {seal.certificate_sha256}; {TRUST_WORDS[seal.trusted]}")
        if seal.long_term:
            say("  its certificate was not revoked at that time, by the authorities' lists in the file")
        say(f"  reason: {seal.reason.text}")
    if documents.attached_to is not None:
        say(f"  attached to {documents.attached_to}, which is signed")
    for words in documents.history:
        say(f"  in the history: {words}")
    for problem in documents.problems:
        say(f"  {problem}")


def _describe_state(problems: Sequence[Refused]) -> str:
    """Return the status in words: TOTAL-PASSED, TOTAL-FAILED or INDETERMINATE of ETSI EN 319 102-1."""
    if not problems:
        return "valid"
    altered = {problem.name for problem in problems} - TRUST_PROBLEMS
    return "NOT VALID" if altered else "NOT SIGNED BY A TRUSTED SIGNER"


TRUST_WORDS = {
    None: "compare it with the laboratory's yourself, or give --trust",
    True: "trusted by --trust",
    False: "not trusted",
}


def _entry(documents: VerifiedFile) -> dict[str, Any]:
    return {
        "file": str(documents.file),
        "whole": not documents.problems,
        "signatures": [
            {
                "signer": signature.signer,
                "certificate_sha256": signature.certificate_sha256,
                "when": None if signature.when is None else signature.when.isoformat(),
                "time_server": signature.time_server,
                "reason": signature.reason.text,
                "trusted": signature.trusted,
                "long_term": signature.long_term,
            }
            for signature in documents.signatures
        ],
        "attached_to": documents.attached_to,
        "history": list(documents.history),
        "problems": [
            {"name": problem.name, "what": problem.what, "remedy": problem.remedy} for problem in documents.problems
        ],
    }
