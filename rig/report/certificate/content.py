"""What a certificate holds, from a result and from what the laboratory says: texts and numbers, no layout."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from types import MappingProxyType
from typing import Any

from rig.analysis.clock import BY_COMPUTER
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
from rig.report.certificate.statements import Stated
from rig.report.entries.omitted import omitted_lines
from rig.report.findings.characteristic import Term, terms
from rig.report.findings.finding import Finding
from rig.report.findings.kind import Standard, Without
from rig.report.kinds.registry import kinds, outlets, shown
from rig.report.words.mounts import mount_lines
from rig.turners.kind import Wording
from rig.turners.registry import words_of


@dataclass(frozen=True, slots=True)
class Gyroscope:
    """One calibrated gyroscope: its result, and its verification if there was one."""

    name: str
    sensor: GyroscopeEntry
    verification: VerificationEntry | None


@dataclass(frozen=True, slots=True)
class HeldStill:
    """The sensors of one `kind` that were calibrated at rest, and what their scale factors hang on.

    Of its size they took the `value`; `origin` is where the laboratory says that comes from.
    """

    kind: str
    standard: Standard
    entries: tuple[Any, ...]
    value: str
    origin: str | None
    traceable: bool

    @property
    def whose(self) -> str:
        """The scale of one of them, in words."""
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind}'s scale"


@dataclass(frozen=True, slots=True)
class Block:
    """What of a result a macro of a template prints, which `place` names: `template:macro`; then what is `beside`."""

    place: str
    found: Finding[Any]
    beside: tuple[Term, ...]

    @property
    def template(self) -> str:
        """The file beside this one."""
        return self.place.partition(":")[0]

    @property
    def macro(self) -> str:
        """What of the file prints it."""
        return self.place.partition(":")[2]


@dataclass(frozen=True, slots=True)
class Certificate:
    """All that a certificate says. `marks` must stand across every page; without any it is one to be signed.

    `reversals` are what turning magnetometers over has told, by the magnetometer's name.
    """

    number: str
    title: str
    marks: tuple[str, ...]
    issued: date
    stated: Stated
    result: ResultDocument
    gyroscopes: tuple[Gyroscope, ...]
    held_still: tuple[HeldStill, ...]
    verified: Mapping[str, VerificationEntry]
    conformity: tuple[CheckEntry, ...]
    fitness: tuple[CheckEntry, ...]
    traceable: bool
    deviations: tuple[str, ...]
    references: tuple[str, ...]
    reversals: Mapping[str, ReversalEntry]

    @property
    def elsewhere(self) -> bool:
        """Whether the readings were recorded elsewhere, and a file tells the motion."""
        return self.provenance.readings_file is not None

    @property
    def by_hand(self) -> bool:
        """Whether a hand turned the items on a table."""
        return any(each.sensor.by_hand is not None for each in self.gyroscopes)

    @property
    def levelled(self) -> bool:
        """Whether an accelerometer told the faces on which a hand laid them."""
        found = (each.sensor.by_hand for each in self.gyroscopes)
        return any(size.name == "acceleration_m_s2" for each in found if each is not None for size in each.errors)

    @property
    def turns(self) -> str:
        """What the sweeps turned through, in words."""
        return f"turns by {' and '.join(self.arcs)}" if self.arcs else "whole turns"

    @property
    def arcs(self) -> tuple[str, ...]:
        """How far sweeps went that were no whole turns."""
        return tuple(sorted({turn_words(angle) for angle in _angles_rad(self.result) if not closes(angle)}))

    @property
    def mounted(self) -> tuple[str, ...]:
        """How the item sat in the stages for which it was mounted anew, in a line each."""
        return tuple(mount_lines(self.result))

    @property
    def arm(self) -> str:
        """What turned the items, by what was found of it."""
        found = self.provenance
        if self.by_hand or (found.readings_file is not None and found.motion_file is None):
            return "a hand, which turned the items on a table"
        if found.motion_file is not None:
            return f"whatever the file {_named(found.motion_file)} tells the motion of"
        if found.arm_model is None:
            return f"{self.words.name} whose model was not recorded"
        return f"{self.words.name} {found.arm_maker} {found.arm_model}"

    @property
    def words(self) -> Wording:
        """How to speak of what turned the items; nothing did where the readings were recorded elsewhere."""
        return words_of(self.provenance.turner_kind or NO_ARM)

    @property
    def procedure(self) -> str:
        """The script that moved the arm, and its hash."""
        if self.provenance.readings_file is not None:
            return f"readings of the file {_named(self.provenance.readings_file)}"
        said = self.provenance.model_dump()
        name, sha256 = said.get("script"), said.get("script_sha256")
        if name is None or sha256 is None:
            return "a script of the rig's own, whose hash was not recorded"
        return f"script {name}, SHA-256 {sha256}"

    @property
    def provenance(self) -> ProvenanceEntry:
        """What was measured with what, and when."""
        return self.result.provenance

    @property
    def performed(self) -> tuple[date, date]:
        """The first and the last day of the measurement."""
        times = (self.provenance.started_utc, *self.provenance.resumed_utc, *self.provenance.verified_utc)
        days = sorted(datetime.fromisoformat(each).date() for each in times)
        return days[0], days[-1]

    @property
    def finds_attitudes(self) -> bool:
        """Whether the readings told how far attitudes were off."""
        return any(hasattr(entry, "attitude_error_rad") for each in self.held_still for entry in each.entries)

    @property
    def temperature_source(self) -> str:
        """What tells how warm the items were: nothing where a file told their motion."""
        found = [each.sensor.bias_conditions for each in self.gyroscopes]
        found += [getattr(entry, "conditions", None) for each in self.held_still for entry in each.entries]
        dated = [when for when in found if when is not None]
        known = [when for when in dated if when.temperature_c is not None]
        if dated and not known:
            return "not known"
        stated = bool(known) and all(when.temperature_stated for when in known)
        return ("as stated" if stated else "the item's own thermometer") + "; not traceable"

    @property
    def blocks(self) -> tuple[Block, ...]:
        """What the page prints of each sensor, one after the other; of a reference nothing."""
        asked = outlets(self.result, lambda kind: kind.block)
        blocks = [
            Block(place, finding, (*terms(kind.characteristics, finding, "certificate"),))
            for kind, place, finding in asked
            if not finding.known
        ]
        order = list(dict.fromkeys(block.found.sensor for block in blocks))
        return tuple(sorted(blocks, key=lambda block: order.index(block.found.sensor)))

    @property
    def calibrates(self) -> bool:
        """Whether anything was calibrated, and not verified alone."""
        return _calibrates(self.result)

    @property
    def without_uncertainty(self) -> tuple[str, ...]:
        """What was calibrated, and of whose uncertainty the solution's spread alone is known."""
        return tuple(_without_uncertainty(self.result))

    @property
    def guarded(self) -> bool:
        """Whether values had to stay below their limits by U."""
        return any(check.guard_band > 0 for check in self.conformity)


def certificate_of(
    result: ResultDocument, stated: Stated, reversals: Mapping[str, ReversalEntry] = MappingProxyType({})
) -> Certificate:
    """The certificate of a result. The same result and statements make the same certificate, its number too.

    Raises Refused `another_sensor` for reversals of magnetometers, or from runs, other than the result's.
    """
    _check_same(result, reversals)
    gyroscopes = tuple(
        Gyroscope(name, sensor, result.verification.get(name))
        for name, sensor in result.gyroscopes.items()
        if sensor.role == "calibrate"
    )
    verified = {name: found for name, found in result.verification.items() if name not in result.gyroscopes}
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
        held_still=tuple(_held_still(result, stated)),
        verified=verified,
        conformity=conformity,
        fitness=fitness,
        traceable=_traceable(result, stated),
        deviations=tuple(_deviations(result)),
        references=tuple(_references(result)),
        reversals=reversals,
    )


def _named(file: FileEntry) -> str:
    return f"{file.name}, SHA-256 {file.sha256}"


def is_simulated(result: ResultDocument, stated: Stated) -> bool:
    """Whether a simulated laboratory was measured in, by the configuration or by what the controller calls itself."""
    return stated.simulated or calls_itself_simulated(result.provenance.arm_software)


def _number(result: ResultDocument, stated: Stated, reversals: Mapping[str, ReversalEntry]) -> str:
    """The day, and a part of the SHA-256 of all the certificate is made of: another content, another number."""
    said = f"{result.text()}\n{stated.site!r}\n{stated.certificate!r}\n{stated.simulated}"
    said += "".join(f"\n{name}: {each.model_dump_json()}" for name, each in reversals.items())
    day = datetime.fromisoformat(result.provenance.started_utc)
    return f"RIG-{day:%Y%m%d}-{hashlib.sha256(said.encode()).hexdigest()[:12].upper()}"


def _calibrates(result: ResultDocument) -> bool:
    """Whether scale factors were found of anything."""
    return any(each.scale is not None for each in shown(result))


def _title(result: ResultDocument) -> str:
    if not _calibrates(result):
        return "Verification report"
    return "Calibration record" if any(_without_uncertainty(result)) else "Calibration certificate"


def _without_uncertainty(result: ResultDocument) -> Iterator[str]:
    """Sensors of which noise alone is known, by estimators that have no budget."""
    for _, show, finding in outlets(result, lambda kind: kind.shown):
        if not finding.known and (row := show(finding)).scale is not None and not row.combined:
            yield finding.sensor


def _check_same(result: ResultDocument, reversals: Mapping[str, ReversalEntry]) -> None:
    for name, each in reversals.items():
        here = result.magnetometers.get(name)
        began = {run.started_utc for run in each.runs}
        if not isinstance(here, MagnetometerEntry) or here.serial_number != each.serial_number:
            why = f"magnetometer {name} {each.serial_number} was turned over, which this run did not calibrate"
        elif result.provenance.started_utc not in began:
            why = f"{name} was turned over between runs of {', '.join(sorted(began))}; this run is none of them"
        else:
            continue
        raise Refused("another_sensor", why, "Give one of the runs that `rig reversal` was given")


def _marks(result: ResultDocument, stated: Stated, fitness: Sequence[CheckEntry]) -> Iterator[str]:
    if is_simulated(result, stated):
        yield "Simulated laboratory: no real item was calibrated"
    if any(_without_uncertainty(result)):
        yield "Not a certificate: the uncertainty is not known"
    if not all(check.passed for check in fitness):
        yield "Not valid: the measurement failed its own checks"


def _angles_rad(result: ResultDocument) -> Iterator[float]:
    """How far the sweeps went; of those of a file that tells speeds it is not known."""
    for sensor in result.gyroscopes.values():
        yield from (each.angle_rad for each in sensor.observations if each.angle_rad is not None)
    for found in result.verification.values():
        yield from (each.angle_rad for each in found.after.revolutions)


def _traceable(result: ResultDocument, stated: Stated) -> bool:
    """Whether the unit of time, the only standard of a gyroscope's scale, hangs on a named reference.

    Encoders, which tell how far an arc went, hang on none.
    """
    compared = result.clock is not None and any(each.clock == BY_COMPUTER for each in result.clock.comparisons)
    measured = bool(result.gyroscopes) and not is_simulated(result, stated)
    whole = all(map(closes, _angles_rad(result)))
    return measured and compared and whole and stated.where.time_reference is not None


def _held_still(result: ResultDocument, stated: Stated) -> Iterator[HeldStill]:
    """Traceable where the size of their only standard has an uncertainty and an origin, and was measured."""
    for kind in kinds():
        entries = tuple(found.entry for found in kind.found(result))
        if isinstance(kind.standard, Without) or not entries:
            continue
        origin, budgets = kind.standard.origin(stated.where), (getattr(each, "budget", None) for each in entries)
        known = all(budget is not None and _size_stated(budget) for budget in budgets)
        traceable = known and origin is not None and not is_simulated(result, stated)
        yield HeldStill(kind.name, kind.standard, entries, kind.standard.value(entries[0]), origin, traceable)


def _size_stated(budget: BudgetEntry) -> bool:
    """A stated uncertainty is that of a normal distribution, an assumed one a half-width."""
    return any(line.kind == "B" and line.distribution == "normal" for line in budget.contributors)


def _deviations(result: ResultDocument) -> Iterator[str]:
    provenance = result.provenance
    if provenance.resumed_utc:
        yield f"The measurement was interrupted and gone on with at {', '.join(provenance.resumed_utc)} (UTC)."
    for name, sensor in result.gyroscopes.items():
        lost = sum(turn.lost_samples for turn in sensor.observations)
        if lost:
            yield f"{name}: {lost} samples were lost within sweeps and left out."
        yield from (f"{name}: {warning}" for warning in getattr(sensor.vector_model, "warnings", ()))
    for _, _, finding in outlets(result, lambda kind: kind.standard):
        said = getattr(finding.entry, "warnings", ())
        yield from (f"{finding.quantity.label(finding.sensor)}: {warning}" for warning in said)
    for name, magnetometer in result.magnetometers.items():
        if isinstance(magnetometer, ErrorEntry):
            yield f"{FIELD.label(name)}, was recorded and not calibrated: {magnetometer.error}"
    for name, faults in result.unsolved.items():
        yield from (f"{name}, {what}, was recorded and not calibrated: {each.error}" for what, each in faults.items())
    yield from (f"{line[:1].upper()}{line[1:]}." for line in omitted_lines(result))
    if not provenance.model_dump().get("script_installed", True):
        yield f"The movement was that of a script of the laboratory's own, {provenance.model_dump().get('script')}."


def _references(result: ResultDocument) -> Iterator[str]:
    """Results that others had found: the calibration a reference came with."""
    for found in {each.reference: each for each in result.verification.values()}.values():
        serial = result.provenance.sensor_serial_numbers.get(found.reference, "not stated")
        scale = ", ".join(f"{k:g}" for k in found.reference_scale)
        bias = ", ".join(f"{b:g}" for b in found.reference_bias_rad_s)
        yield (
            f"Reference {found.reference}, serial number {serial}: scale factors {scale}, biases {bias} rad/s, as "
            "stated in the laboratory's configuration, without an uncertainty."
        )
