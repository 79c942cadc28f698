"""The typed outcome of a run as the document of `result.json`."""

from collections.abc import Sequence

from rig.analysis.acceleration import AccelerometerResult
from rig.analysis.calibration import SensorResult
from rig.analysis.magnetic_field import MagnetometerResult
from rig.analysis.outcome import Origin, Outcome
from rig.analysis.told_from import ToldFrom
from rig.analysis.verdict import Check
from rig.analysis.when import of_accelerometer, of_gyroscope, of_magnetometer
from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import SCHEMA, CheckEntry, ProvenanceEntry, ResultDocument, SensorEntry
from rig.data.result_types import ErrorEntry, Role
from rig.errors import Fault
from rig.report.accelerometer_entry import accelerometer_entry
from rig.report.budget_entry import clock_entry
from rig.report.drift_entry import drift_entry
from rig.report.entry import entry
from rig.report.magnetometer_entry import magnetometer_entry
from rig.report.sensor_entry import sensor_entry
from rig.report.told_words import told_from_entries
from rig.report.verification_entry import verification_entry
from rig.report.when_entry import when_entry


def document_of(outcome: Outcome) -> ResultDocument:
    """Plain numbers, texts and tuples, in SI units, of schema "rig.result/1"."""
    document = ResultDocument(
        schema=SCHEMA,
        verdict=outcome.verdict,
        checks=tuple(map(_check, outcome.checks)),
        provenance=_provenance(outcome.provenance),
        sensors={name: _sensor(outcome, name, result) for name, result in outcome.results.items()},
        verification={name: verification_entry(found) for name, found in outcome.verifications.items()},
    )
    more: dict[str, object] = {}
    if outcome.clock is not None:
        more["clock"] = clock_entry(outcome.clock)
    if outcome.accelerometers:
        more["accelerometers"] = {
            name: _accelerometer(outcome, name, found) for name, found in outcome.accelerometers.items()
        }
    if outcome.magnetometers:
        more["magnetometers"] = {
            name: _magnetometer(outcome, name, found) for name, found in outcome.magnetometers.items()
        }
    if outcome.drifts:
        more["bias_drift"] = {
            name: {quantity.name: drift_entry(quantity, drift) for quantity, drift in each.items()}
            for name, each in outcome.drifts.items()
        }
    return document.model_copy(update=more)


def _sensor(outcome: Outcome, name: str, result: SensorResult) -> SensorEntry:
    role: Role = "calibrate" if name in outcome.settings.to_calibrate else "reference"
    held = of_gyroscope(outcome.recordings, name)
    told = {
        "scale_at": when_entry(held.scale),
        "bias_at": when_entry(held.bias),
        **_told_from(outcome.told_from.get(name, ())),
    }
    return sensor_entry(result, role, outcome.onboard.get(name)).model_copy(update=told)


def _accelerometer(outcome: Outcome, name: str, result: AccelerometerResult) -> AccelerometerEntry:
    found = of_accelerometer(outcome.recordings, name, (dwell.index for dwell in result.dwells))
    return accelerometer_entry(result).model_copy(
        update={"found_at": when_entry(found), **_told_from(outcome.told_from_in_reference.get(name, ()))}
    )


def _magnetometer(outcome: Outcome, name: str, result: MagnetometerResult | Fault) -> MagnetometerEntry | ErrorEntry:
    made = magnetometer_entry(result)
    if isinstance(result, Fault):
        return made
    found = of_magnetometer(outcome.recordings, (dwell.index for dwell in result.dwells))
    told_from = _told_from(outcome.told_from_in_reference.get(name, ()))
    return made.model_copy(update={"found_at": when_entry(found), **told_from})


def _told_from(found: Sequence[ToldFrom]) -> dict[str, object]:
    return {"told_from": told_from_entries(found)} if found else {}


def _check(check: Check) -> CheckEntry:
    if check.uncertainty is not None:
        return entry(CheckEntry, check)
    return CheckEntry(name=check.name, value=check.value, limit=check.limit, unit=check.unit, passed=check.passed)


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
