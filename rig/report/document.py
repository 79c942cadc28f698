"""The typed outcome of a run as the document of `result.json`."""

from typing import Any

from rig.analysis.check import Check
from rig.analysis.gyroscope.mounts import FoundMount
from rig.analysis.outcome import Origin, Outcome
from rig.data.meaning import Meaning
from rig.data.result_file import SCHEMA, CheckEntry, MountEntry, ProvenanceEntry, ResultDocument
from rig.report.entries.budget import clock_entry
from rig.report.entries.external import unsolved
from rig.report.entries.omitted import notes, omitted
from rig.report.entry import entry
from rig.report.findings.kind import Without
from rig.report.kinds.registry import kinds

ALWAYS = ("gyroscopes", "verification")  # there of every run, if only to say that there are none


def document_of(outcome: Outcome) -> ResultDocument:
    """The result as plain numbers, texts and tuples, in SI units, of schema "rig.result/1"."""
    made = {kind.key: kind.entries(outcome) for kind in kinds() if not isinstance(kind.entries, Without)}
    found: dict[str, object] = {key: entries for key, entries in made.items() if entries or key in ALWAYS}
    others = {key: _plain(found.pop(key)) for key in list(found) if key not in ResultDocument.model_fields}
    clock = {} if outcome.clock is None else {"clock": clock_entry(outcome.clock)}
    return ResultDocument.model_validate(
        {
            "schema": SCHEMA,
            "verdict": outcome.verdict,
            "checks": tuple(map(_check, outcome.checks)),
            "provenance": _provenance(outcome.provenance),
            **clock,
            **found,
            **({"unsolved": faults} if (faults := unsolved(outcome)) else {}),
            **({"omitted": left_out} if (left_out := omitted(outcome)) else {}),
            **({"notes": said} if (said := notes(outcome)) else {}),
            **({"others": others} if others else {}),
            **({"mounts": tuple(map(_mount, outcome.mounts))} if outcome.mounts else {}),
        }
    )


def _mount(mount: FoundMount) -> MountEntry:
    return MountEntry.model_validate(
        {"stage": mount.stage + 1, "rotation_rad": tuple(mount.turn_rad), "std_rad": tuple(mount.std_rad)}
    )


def _plain(entries: Any) -> dict[str, Any]:
    """Entries of a kind that a package adds, as JSON has them."""
    return {name: each.model_dump(mode="json") for name, each in entries.items()}


def _check(check: Check) -> CheckEntry:
    means = {name: value for name, value in _meaning(check.means).items() if value is not None}
    if check.uncertainty is not None:
        return entry(CheckEntry, check, **means)
    return CheckEntry(
        name=check.name, value=check.value, limit=check.limit, unit=check.unit, passed=check.passed, **means
    )


def _meaning(means: Meaning) -> dict[str, Any]:
    """Return what a check is of, by the fields of its entry."""
    return {
        "kind": means.kind,
        "sensor": means.sensor,
        "quantity": means.quantity,
        "parameter": means.parameter,
        "sweep": means.sweep,
        "criterion": means.what,
    }


def _provenance(origin: Origin) -> ProvenanceEntry:
    return ProvenanceEntry.model_validate(
        {
            **origin.recorded.document(),
            "stored_calibrations": origin.stored_calibrations,
            "resumed_utc": origin.resumed_utc,
            "verified_utc": origin.verified_utc,
            "solved_utc": origin.solved_utc.isoformat(timespec="seconds"),
        }
    )
