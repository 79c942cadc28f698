"""`rig verify`: who signed a certificate, when, whether it is unchanged, and whether a history knows it."""

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.config_arguments import add_json
from rig.commands.history.named_history import named_history
from rig.errors import Refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.report.signatures.findings import FileInspection, SignatureReport

SIZE_MAX_BYTES = 256_000_000
SCHEMA = "rig.verification/1"
WRONG, NOBODY_TRUSTED = 1, 4
BY_NOBODY_TRUSTED = {"not_signed", "signer_unknown", "signer_not_trusted"}  # all is well but who answers for the file
STATUSES = (
    "exit status: 0 no file was changed, and signed by whom --trust and --signer say, or attached to one that is, or "
    f"known to the history that --history names; {WRONG} a file was altered, or the history contradicts it; "
    f"{NOBODY_TRUSTED} nobody who is trusted has signed a file: it is not signed, signed by another, or there is no "
    "--trust; 2 it could not be found out"
)


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig verify`."""
    parser.epilog = STATUSES
    parser.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="a signed certificate.pdf or certificate.xml; beside it what is attached to it, such as result.json",
    )
    parser.add_argument(
        "--trust",
        action="append",
        default=[],
        type=Path,
        metavar="CERTIFICATE",
        help="that of the laboratory's key, or of who issued it, or of a time server: PEM or DER; may be repeated; the "
        "key's certificate must be made for signing documents",
    )
    parser.add_argument(
        "--signer",
        metavar="NAME",
        help="the name that the key's certificate must have: its common name, or all of it, as CN=Example,O=Laboratory",
    )
    parser.add_argument(
        "--history", metavar="PLACE", help="whether this history knows the files, and still has them so"
    )
    add_json(parser)


@dataclass(frozen=True, slots=True)
class _Found:
    file: Path
    signatures: "tuple[SignatureReport, ...]"
    history: tuple[str, ...]
    attached_to: str | None
    problems: tuple[Refused, ...]


def run(options: Namespace) -> int:
    """Look at each file and say what is found; returns 0, or the exit status that `--help` names.

    Raises Refused `bad_option`, `verify_file`, and as `read_trusted_certificates`, `inspect_file` and `open_history`.
    """
    from rig.report.signatures.inspection import inspect_file, read_trusted_certificates
    from rig.report.signatures.trust import Trust

    if options.signer is not None and not options.trust:
        what = "--signer names whom a trusted authority must have certified, and no --trust says which authority"
        raise Refused("bad_option", what, "Give --trust CERTIFICATE too, or leave it out")
    trust = Trust(read_trusted_certificates(options.trust), options.signer)
    contents = {file: _content(file) for file in options.files}
    looks = {file: inspect_file(file.name, content, trust) for file, content in contents.items()}
    named = named_history(options.history)
    known = {} if named is None else _known(named, contents, looks)
    found = [_found(file, contents[file], looks, known.get(file)) for file in contents]
    if options.json:
        print(json.dumps({"schema": SCHEMA, "files": list(map(_entry, found))}, indent=2))
    else:
        for each in found:
            _tell(each)
    problems = {problem.name for document in found for problem in document.problems}
    return WRONG if problems - BY_NOBODY_TRUSTED else NOBODY_TRUSTED if problems else 0


def _content(file: Path) -> bytes:
    from rig.config.files.regular_file import UnfitFile, read_regular_file

    try:
        return read_regular_file(file, SIZE_MAX_BYTES)
    except (UnfitFile, OSError) as error:
        why = getattr(error, "strerror", None) or error
        raise Refused("verify_file", f"{file} cannot be read: {why}", "Give the files of a certificate") from None


def _known(named: str, contents: Mapping[Path, bytes], looks: "Mapping[Path, FileInspection]") -> dict[Path, Any]:
    """What the history says of each file."""
    from rig.commands.history.waiting import answer_of
    from rig.history.entered_file import find_file_entries
    from rig.history.storage.address import resolve_address
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    where = resolve_address(named)
    if not is_there(where):  # to look makes none
        raise Refused("history_unreachable", f"there is no history {where.label}", "Name another with --history")

    def asked() -> dict[Path, Any]:
        with open_history(where) as history:
            anchors = {
                file: next((each.reason.anchor for each in look.signatures if each.reason.anchor), None)
                for file, look in looks.items()
            }
            return {
                file: find_file_entries(history, file.name, content, anchors[file])
                for file, content in contents.items()
            }

    return answer_of(asked)


def _found(file: Path, content: bytes, looks: "Mapping[Path, FileInspection]", known: Any) -> _Found:
    """A file that has no signature of its own is held by the signed one it is attached to, or by the history."""
    look, attached_to = looks[file], None
    problems = look.problems
    if not look.signatures:
        attached_to, problems = _held(file.name, content, look, looks)
        if known is not None and not known.problems:
            problems = tuple(problem for problem in problems if problem.name not in BY_NOBODY_TRUSTED)
    said = () if known is None else known.said
    return _Found(file, look.signatures, said, attached_to, (*problems, *(() if known is None else known.problems)))


def _held(
    name: str, content: bytes, look: "FileInspection", looks: "Mapping[Path, FileInspection]"
) -> tuple[str | None, tuple[Refused, ...]]:
    """The signed file that an unsigned one is attached to, and what is wrong: if it is attached, as with its signer."""
    from rig.report.signatures.findings import not_as_signed

    holders = {other: signed for other, signed in looks.items() if name in signed.attached}
    same = [other for other, signed in holders.items() if signed.attached[name] == content]
    if same:
        best = min(same, key=lambda other: len(looks[other].problems))
        return best.name, looks[best].problems
    if holders and {problem.name for problem in look.problems} == {"not_signed"}:
        named = ", ".join(dict.fromkeys(other.name for other in holders))
        return None, (not_as_signed(name, f"another is attached to {named}"),)
    return None, look.problems


def _tell(documents: _Found) -> None:
    say(f"{documents.file}: {_state(documents.problems)}")
    for each in documents.signatures:
        when = "at a time it does not say" if each.when is None else f"{each.when:%Y-%m-%d %H:%M:%S %Z}"
        clock = "the signer's own clock" if each.time_server is None else f"the time server {each.time_server}"
        say(f"  signed by {each.signer}, {when} by {clock}")
        say(f"  its certificate has SHA-256 {each.certificate_sha256}; {_TRUSTED[each.trusted]}")
        if each.long_term:
            say("  its certificate was not revoked at that time, by the authorities' lists in the file")
        say(f"  reason: {each.reason.text}")
    if documents.attached_to is not None:
        say(f"  attached to {documents.attached_to}, which is signed")
    for words in documents.history:
        say(f"  in the history: {words}")
    for problem in documents.problems:
        say(f"  {problem}")


def _state(problems: Sequence[Refused]) -> str:
    if not problems:
        return "whole"
    altered = {problem.name for problem in problems} - BY_NOBODY_TRUSTED
    return "NOT WHOLE, or not to be relied on" if altered else "NOT SIGNED BY ANYBODY WHO IS TRUSTED"


_TRUSTED = {
    None: "whether that is the laboratory's, compare yourself, or give --trust",
    True: "trusted by --trust",
    False: "not trusted",
}


def _entry(documents: _Found) -> dict[str, Any]:
    return {
        "file": str(documents.file),
        "whole": not documents.problems,
        "signatures": [
            {
                "signer": each.signer,
                "certificate_sha256": each.certificate_sha256,
                "when": None if each.when is None else each.when.isoformat(),
                "time_server": each.time_server,
                "reason": each.reason.text,
                "trusted": each.trusted,
                "long_term": each.long_term,
            }
            for each in documents.signatures
        ],
        "attached_to": documents.attached_to,
        "history": list(documents.history),
        "problems": [{"name": each.name, "what": each.what, "remedy": each.remedy} for each in documents.problems],
    }
