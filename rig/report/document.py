"""The typed outcome of a run as the document of `result.json`."""

from typing import Any

from rig.analysis.check import Check
from rig.analysis.gyroscope.stage_mounts import EstimatedMount
from rig.analysis.outcome import Origin, Outcome
from rig.data.meaning import Meaning
from rig.data.result_file import SCHEMA, CheckEntry, MountEntry, ProvenanceEntry, ResultDocument
from rig.report.entries.budget import clock_entry
from rig.report.entries.omission_entries import list_omissions, list_unsolved_entries, notes
from rig.report.entry import entry
from rig.report.findings.result_kind import NoOutlet
from rig.report.kinds.kind_registry import kinds

REQUIRED_KEYS = ("gyroscopes", "verification")  # in every result, even if they are empty


def document_of(outcome: Outcome) -> ResultDocument:
    """Return the result as plain numbers, texts and tuples, in SI units, in the schema "rig.result/1"."""
    by_kind = {kind.key: kind.entries(outcome) for kind in kinds() if not isinstance(kind.entries, NoOutlet)}
    entries: dict[str, object] = {key: of_kind for key, of_kind in by_kind.items() if of_kind or key in REQUIRED_KEYS}
    others = {key: _plain_values(entries.pop(key)) for key in list(entries) if key not in ResultDocument.model_fields}
    clock = {} if outcome.clock is None else {"clock": clock_entry(outcome.clock)}
    return ResultDocument.model_validate(
        {
            "schema": SCHEMA,
            "verdict": outcome.verdict,
            "checks": tuple(map(_check, outcome.checks)),
            "provenance": _provenance(outcome.provenance),
            **clock,
            **entries,
            **({"unsolved": faults} if (faults := list_unsolved_entries(outcome)) else {}),
            **({"omitted": omissions} if (omissions := list_omissions(outcome)) else {}),
            **({"notes": remarks} if (remarks := notes(outcome)) else {}),
            **({"others": others} if others else {}),
            **({"mounts": tuple(map(_mount, outcome.mounts))} if outcome.mounts else {}),
        }
    )


def _mount(mount: EstimatedMount) -> MountEntry:
    return MountEntry.model_validate(
        {"stage": mount.stage + 1, "rotation_rad": tuple(mount.rotation_rad), "std_rad": tuple(mount.std_rad)}
    )


def _plain_values(entries: Any) -> dict[str, Any]:
    """Return, as JSON values, the entries of a kind of result that an installed package defines."""
    return {name: sensor_entry.model_dump(mode="json") for name, sensor_entry in entries.items()}


def _check(check: Check) -> CheckEntry:
    means = {name: value for name, value in _meaning(check.means).items() if value is not None}
    if check.uncertainty is not None:
        return entry(CheckEntry, check, **means)
    return CheckEntry(
        name=check.name, value=check.value, limit=check.limit, unit=check.unit, passed=check.passed, **means
    )


def _meaning(means: Meaning) -> dict[str, Any]:
    """Return the fields of a check's entry that name its sensor, quantity and parameter."""
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
