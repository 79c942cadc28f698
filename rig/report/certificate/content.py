"""The content of a certificate, without layout, from a result and the laboratory's statements."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from types import MappingProxyType
from typing import Any

from rig.analysis.clock_comparison import COMPUTER_CLOCK
from rig.data.absent import NO_ARM
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import FIELD
from rig.data.recording.provenance import calls_itself_simulated
from rig.data.result_file import (
    CheckEntry,
    FileEntry,
    GyroscopeEntry,
    ProvenanceEntry,
    ResultDocument,
    VerificationEntry,
)
from rig.errors import Refused
from rig.motion.steps import closes, turn_words
from rig.report.certificate.statements import StatedFacts
from rig.report.entries.omission_entries import omission_lines
from rig.report.findings.characteristic import Term, terms
from rig.report.findings.finding import Finding
from rig.report.findings.result_kind import NoOutlet, Standard
from rig.report.kinds.kind_registry import kinds, outlets, shown
from rig.report.words.mounting_words import mount_lines
from rig.turners.turner_kind import Wording
from rig.turners.turner_registry import words_of


@dataclass(frozen=True, slots=True)
class CertifiedGyroscope:
    """One calibrated gyroscope: its result (`sensor`), and its verification, if any."""

    name: str
    sensor: GyroscopeEntry
    verification: VerificationEntry | None


@dataclass(frozen=True, slots=True)
class RestCalibration:
    """The sensors of one `kind` that were calibrated at rest, and the reference standard of their scale factors.

    `value` is the standard's stated value, `origin` the laboratory's statement of where this value comes from.
    """

    kind: str
    standard: Standard
    entries: tuple[Any, ...]
    value: str
    origin: str | None
    traceable: bool

    @property
    def whose(self) -> str:
        """Words for the scale of these sensors, with an article, such as "an accelerometer's scale"."""
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind}'s scale"


@dataclass(frozen=True, slots=True)
class Block:
    """A finding with its further characteristics (`terms`), and the `template:macro` that prints both."""

    macro_path: str
    finding: Finding[Any]
    terms: tuple[Term, ...]

    @property
    def template(self) -> str:
        """The template's file."""
        return self.macro_path.partition(":")[0]

    @property
    def macro(self) -> str:
        """The name of the macro in the template's file."""
        return self.macro_path.partition(":")[2]


@dataclass(frozen=True, slots=True)
class Certificate:
    """The content of a certificate.

    `marks` are printed across every page; a certificate without marks is ready to be signed. `conformity` are the
    checks of the items, `fitness` those of the measurement itself. `reversals` are results of turning magnetometers
    over, by the magnetometer's name.
    """

    number: str
    title: str
    marks: tuple[str, ...]
    issued: date
    stated: StatedFacts
    result: ResultDocument
    gyroscopes: tuple[CertifiedGyroscope, ...]
    calibrated_at_rest: tuple[RestCalibration, ...]
    verified: Mapping[str, VerificationEntry]
    conformity: tuple[CheckEntry, ...]
    fitness: tuple[CheckEntry, ...]
    traceable: bool
    deviations: tuple[str, ...]
    references: tuple[str, ...]
    reversals: Mapping[str, ReversalEntry]

    @property
    def external(self) -> bool:
        """Whether the readings are external, with the motion given by a file."""
        return self.provenance.readings_file is not None

    @property
    def by_hand(self) -> bool:
        """Whether a hand turned the items on a table."""
        return any(gyroscope.sensor.by_hand is not None for gyroscope in self.gyroscopes)

    @property
    def levelled(self) -> bool:
        """Whether an accelerometer was used as a level in a session by hand, to measure the vertical at rest."""
        sessions = (gyroscope.sensor.by_hand for gyroscope in self.gyroscopes)
        return any(
            error.name == "acceleration_m_s2" for entry in sessions if entry is not None for error in entry.errors
        )

    @property
    def turns(self) -> str:
        """The angles of the sweeps, in words."""
        return f"turns by {' and '.join(self.arcs)}" if self.arcs else "whole turns"

    @property
    def arcs(self) -> tuple[str, ...]:
        """The angles of sweeps that were not whole turns, in words."""
        return tuple(sorted({turn_words(angle) for angle in _angles_rad(self.result) if not closes(angle)}))

    @property
    def mounted(self) -> tuple[str, ...]:
        """The measured error of the item's mounting in each stage after the first, one line for each."""
        return tuple(mount_lines(self.result))

    @property
    def arm(self) -> str:
        """The machine or hand that turned the items, according to its recorded model."""
        provenance = self.provenance
        if self.by_hand or (provenance.readings_file is not None and provenance.motion_file is None):
            return "a hand, which turned the items on a table"
        if provenance.motion_file is not None:
            return f"the body whose motion the file {_file_words(provenance.motion_file)} states"
        if provenance.arm_model is None:
            return f"{self.words.name} whose model was not recorded"
        return f"{self.words.name} {provenance.arm_maker} {provenance.arm_model}"

    @property
    def words(self) -> Wording:
        """The wording for the kind of turner; external readings have a neutral wording."""
        return words_of(self.provenance.turner_kind or NO_ARM)

    @property
    def procedure(self) -> str:
        """The script that moved the arm with its hash, or the file of external readings, in words."""
        if self.provenance.readings_file is not None:
            return f"readings of the file {_file_words(self.provenance.readings_file)}"
        fields = self.provenance.model_dump()
        name, sha256 = fields.get("script"), fields.get("script_sha256")
        if name is None or sha256 is None:
            return "a script of the rig's own, whose hash was not recorded"
        return f"script {name}, SHA-256 {sha256}"

    @property
    def provenance(self) -> ProvenanceEntry:
        """The equipment and the times of the measurement."""
        return self.result.provenance

    @property
    def performed(self) -> tuple[date, date]:
        """The first and the last day of the measurement."""
        times = (self.provenance.started_utc, *self.provenance.resumed_utc, *self.provenance.verified_utc)
        days = sorted(datetime.fromisoformat(time).date() for time in times)
        return days[0], days[-1]

    @property
    def finds_attitudes(self) -> bool:
        """Whether the attitude error was estimated from the readings."""
        return any(hasattr(entry, "attitude_error_rad") for kind in self.calibrated_at_rest for entry in kind.entries)

    @property
    def temperature_source(self) -> str:
        """The source of the items' temperatures, in words."""
        conditions = [gyroscope.sensor.bias_conditions for gyroscope in self.gyroscopes]
        conditions += [getattr(entry, "conditions", None) for kind in self.calibrated_at_rest for entry in kind.entries]
        dated = [when for when in conditions if when is not None]
        measured = [when for when in dated if when.temperature_c is not None]
        if dated and not measured:
            return "not known"
        stated = bool(measured) and all(when.temperature_stated for when in measured)
        return ("as stated" if stated else "the item's own thermometer") + "; not traceable"

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The result blocks of the certificate, sensor by sensor; a reference sensor has no block."""
        printable = outlets(self.result, lambda kind: kind.block)
        blocks = [
            Block(macro_path, finding, (*terms(kind.characteristics, finding, "certificate"),))
            for kind, macro_path, finding in printable
            if not finding.is_reference
        ]
        order = list(dict.fromkeys(block.finding.sensor for block in blocks))
        return tuple(sorted(blocks, key=lambda block: order.index(block.finding.sensor)))

    @property
    def calibrates(self) -> bool:
        """Whether anything was calibrated, not only verified."""
        return _calibrates(self.result)

    @property
    def without_uncertainty(self) -> tuple[str, ...]:
        """The calibrated sensors whose stated uncertainty contains only noise."""
        return tuple(_find_incomplete(self.result))

    @property
    def guarded(self) -> bool:
        """Whether any limit of conformity is reduced by a guard band of U."""
        return any(check.guard_band > 0 for check in self.conformity)


def certificate_of(
    result: ResultDocument, stated: StatedFacts, reversals: Mapping[str, ReversalEntry] = MappingProxyType({})
) -> Certificate:
    """Return the certificate of a result; its whole content, including its number, depends on the arguments alone.

    Raise Refused `another_sensor` if reversals are of other magnetometers, or of other runs, than the result's.
    """
    _check_same(result, reversals)
    gyroscopes = tuple(
        CertifiedGyroscope(name, sensor, result.verification.get(name))
        for name, sensor in result.gyroscopes.items()
        if sensor.role == "calibrate"
    )
    verified = {name: entry for name, entry in result.verification.items() if name not in result.gyroscopes}
    conformity, fitness = (
        tuple(check for check in result.checks if check.means.kind == kind) for kind in ("conformity", "fitness")
    )
    return Certificate(
        number=_number(result, stated, reversals),
        title=_title(result),
        marks=tuple(_marks(result, stated, fitness)),
        issued=stated.certificate.issued or datetime.fromisoformat(result.provenance.solved_utc).date(),
        stated=stated,
        result=result,
        gyroscopes=gyroscopes,
        calibrated_at_rest=tuple(_find_rest_calibrations(result, stated)),
        verified=verified,
        conformity=conformity,
        fitness=fitness,
        traceable=_traceable(result, stated),
        deviations=tuple(_deviations(result)),
        references=tuple(_references(result)),
        reversals=reversals,
    )


def _file_words(file: FileEntry) -> str:
    return f"{file.name}, SHA-256 {file.sha256}"


def is_simulated(result: ResultDocument, stated: StatedFacts) -> bool:
    """Return whether the laboratory was simulated, by the configuration or by the controller's statement."""
    return stated.simulated or calls_itself_simulated(result.provenance.arm_software)


def _number(result: ResultDocument, stated: StatedFacts, reversals: Mapping[str, ReversalEntry]) -> str:
    """Return the certificate's number, which changes with its content: the day and a part of the content's SHA-256."""
    content = f"{result.text()}\n{stated.site!r}\n{stated.certificate!r}\n{stated.simulated}"
    content += "".join(f"\n{name}: {reversal.model_dump_json()}" for name, reversal in reversals.items())
    day = datetime.fromisoformat(result.provenance.started_utc)
    return f"RIG-{day:%Y%m%d}-{hashlib.sha256(content.encode()).hexdigest()[:12].upper()}"


def _calibrates(result: ResultDocument) -> bool:
    """Return whether scale factors of any sensor were measured."""
    return any(row.scale is not None for row in shown(result))


def _title(result: ResultDocument) -> str:
    if not _calibrates(result):
        return "Verification report"
    return "Calibration record" if any(_find_incomplete(result)) else "Calibration certificate"


def _find_incomplete(result: ResultDocument) -> Iterator[str]:
    """Yield the sensors whose U contains only noise, because their estimator has no budget."""
    for _, show, finding in outlets(result, lambda kind: kind.shown):
        if not finding.is_reference and (row := show(finding)).scale is not None and not row.combined:
            yield finding.sensor


def _check_same(result: ResultDocument, reversals: Mapping[str, ReversalEntry]) -> None:
    """Raise Refused `another_sensor` unless the reversals contain this run and its magnetometers."""
    for name, reversal in reversals.items():
        entry = result.magnetometers.get(name)
        starts = {run.started_utc for run in reversal.runs}
        if not isinstance(entry, MagnetometerEntry) or entry.serial_number != reversal.serial_number:
            why = f"the reversal is of magnetometer {name} {reversal.serial_number}, which this run did not calibrate"
        elif result.provenance.started_utc not in starts:
            why = f"the reversal of {name} is from runs of {', '.join(sorted(starts))}, and this run is not among them"
        else:
            continue
        raise Refused("another_sensor", why, "Give one of the runs that `rig reversal` was given")


def _marks(result: ResultDocument, stated: StatedFacts, fitness: Sequence[CheckEntry]) -> Iterator[str]:
    if is_simulated(result, stated):
        yield "Simulated laboratory: no real item was calibrated"
    if any(_find_incomplete(result)):
        yield "Not a certificate: the uncertainty is not known"
    if not all(check.passed for check in fitness):
        yield "Not valid: the measurement failed its own checks"


def _angles_rad(result: ResultDocument) -> Iterator[float]:
    """Yield the angles of all sweeps, except those of which a file states only the speed."""
    for sensor in result.gyroscopes.values():
        yield from (turn.angle_rad for turn in sensor.observations if turn.angle_rad is not None)
    for verification in result.verification.values():
        yield from (turn.angle_rad for turn in verification.after.revolutions)


def _traceable(result: ResultDocument, stated: StatedFacts) -> bool:
    """Return whether time, the only standard of a gyroscope's scale, is traceable to a stated reference.

    Arcs are not traceable, because encoders measure their angles.
    """
    compared = result.clock is not None and any(
        comparison.clock == COMPUTER_CLOCK for comparison in result.clock.comparisons
    )
    measured = bool(result.gyroscopes) and not is_simulated(result, stated)
    whole = all(map(closes, _angles_rad(result)))
    return measured and compared and whole and stated.where.time_reference is not None


def _find_rest_calibrations(result: ResultDocument, stated: StatedFacts) -> Iterator[RestCalibration]:
    """Yield the sensors measured at rest, kind by kind.

    A sensor is traceable if its standard was measured, and the standard's uncertainty and origin are stated.
    """
    for kind in kinds():
        entries = tuple(finding.entry for finding in kind.find(result))
        if isinstance(kind.standard, NoOutlet) or not entries:
            continue
        origin, budgets = kind.standard.origin(stated.where), (getattr(entry, "budget", None) for entry in entries)
        stated_size = all(budget is not None and _size_stated(budget) for budget in budgets)
        traceable = stated_size and origin is not None and not is_simulated(result, stated)
        yield RestCalibration(kind.name, kind.standard, entries, kind.standard.value(entries[0]), origin, traceable)


def _size_stated(budget: BudgetEntry) -> bool:
    """Return whether the standard's uncertainty was stated, so that the budget has a normal contributor of type B."""
    return any(line.kind == "B" and line.distribution == "normal" for line in budget.contributors)


def _deviations(result: ResultDocument) -> Iterator[str]:
    """Yield what was unusual in the measurement, a sentence each: interruptions, losses, warnings, omissions."""
    provenance = result.provenance
    if provenance.resumed_utc:
        yield f"The measurement was interrupted and continued at {', '.join(provenance.resumed_utc)} (UTC)."
    for name, sensor in result.gyroscopes.items():
        lost = sum(turn.lost_samples for turn in sensor.observations)
        if lost:
            yield f"{name}: {lost} samples were lost within sweeps and left out."
        yield from (f"{name}: {warning}" for warning in getattr(sensor.vector_model, "warnings", ()))
    for _, _, finding in outlets(result, lambda kind: kind.standard):
        warnings = getattr(finding.entry, "warnings", ())
        yield from (f"{finding.quantity.label(finding.sensor)}: {warning}" for warning in warnings)
    for name, magnetometer in result.magnetometers.items():
        if isinstance(magnetometer, ErrorEntry):
            yield f"{FIELD.label(name)} was recorded and not calibrated: {magnetometer.error}"
    for name, faults in result.unsolved.items():
        yield from (f"{name}, {what}, was recorded and not calibrated: {fault.error}" for what, fault in faults.items())
    yield from (f"{line[:1].upper()}{line[1:]}." for line in omission_lines(result))
    if not provenance.model_dump().get("script_installed", True):
        yield f"The movement was that of a script of the laboratory's own, {provenance.model_dump().get('script')}."


def _references(result: ResultDocument) -> Iterator[str]:
    """Yield the calibrations of reference sensors, which are results of other laboratories."""
    for entry in {entry.reference: entry for entry in result.verification.values()}.values():
        serial = result.provenance.sensor_serial_numbers.get(entry.reference, "not stated")
        scale = ", ".join(f"{k:g}" for k in entry.reference_scale)
        bias = ", ".join(f"{b:g}" for b in entry.reference_bias_rad_s)
        yield (
            f"Reference {entry.reference}, serial number {serial}: scale factors {scale}, biases {bias} rad/s, as "
            "stated in the laboratory's configuration, without an uncertainty."
        )
