"""Which signed file an unsigned file belongs to: by its bytes, under whatever name, and what is said if none has it."""

from datetime import UTC, datetime
from pathlib import Path

from rig.commands.documents.verify import find_signed_holder
from rig.report.signatures.findings import FileInspection, SignatureReport, not_signed
from rig.report.signatures.reason import Reason

REPORT = SignatureReport("CN=Laboratory", "00", datetime(2026, 11, 29, tzinfo=UTC), None, Reason(""), trusted=True)
SIGNED = {Path("certificate.pdf"): FileInspection((REPORT,), {"result.json": b"{}", "calibration.h": b"//"})}


def held(name: str, content: bytes, signed: dict[Path, FileInspection] = SIGNED) -> tuple[str | None, str]:
    look = FileInspection(problems=(not_signed(name),))
    holder, problems = find_signed_holder(name, content, look, {**signed, Path(name): look})
    return holder, "; ".join(map(str, problems))


def test_an_attached_file_is_found_by_its_bytes_under_any_name() -> None:
    assert held("result.json", b"{}") == ("certificate.pdf", "")
    assert held("result-of-monday.json", b"{}") == ("certificate.pdf as result.json", "")


def test_an_altered_file_is_named_as_another_than_the_attached_one() -> None:
    assert "not_as_signed: result.json is not as it was signed: another is attached to certificate.pdf" in str(
        held("result.json", b"{ }")
    )
    assert held("result.json", b"//")[0] is None, "an attached file under the name of another one is not that one"


def test_a_file_that_is_attached_nowhere_says_what_was_compared() -> None:
    holder, said = held("other.json", b"{ }")
    assert holder is None and said.startswith(
        "not_signed: other.json has no signature of its own, and its bytes are those of no file attached to "
        "certificate.pdf (result.json, calibration.h). Give"
    )


def test_a_file_alone_says_that_nothing_was_given_to_compare_with() -> None:
    assert (
        "has no signature of its own, and no file that might contain it is given" in held("result.json", b"{}", {})[1]
    )
