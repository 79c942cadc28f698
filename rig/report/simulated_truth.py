"""The truth of a simulated laboratory next to the result, (result − truth)/U, for display; no estimator reads it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.section import SensorName
from rig.data.quantity import ACCELERATION, RATE
from rig.data.result_file import ResultDocument
from rig.data.run_folder import TRUTH_FILE
from rig.data.validation import Finite, parse_json, validate
from rig.report.findings.result_kind import AxisValues, DisplayRow
from rig.report.kinds.kind_registry import shown
from rig.report.words.printed_values import format_signed, format_with_u

SIZE_MAX_BYTES = 1_000_000
Vector3 = tuple[Finite, Finite, Finite]


@dataclass(frozen=True, slots=True)
class TrueGyroscope:
    """Means of a simulated gyroscope's true bias, and of its scale factors if defined, over the run's time windows."""

    bias_rad_s: Vector3
    scale: Vector3 | None = None


@dataclass(frozen=True, slots=True)
class TrueAccelerometer:
    """Means of a simulated accelerometer's true bias and scale factors over the run's time windows."""

    bias_m_s2: Vector3
    scale: Vector3


@dataclass(frozen=True, slots=True)
class _TruthFile:
    schema: Literal["rig.truth/1"]
    simulated: Literal[True]
    gyroscopes: dict[SensorName, TrueGyroscope]
    accelerometers: dict[SensorName, TrueAccelerometer]


@dataclass(frozen=True, slots=True)
class TrueValues:
    """Results of the axes, their true values in the same unit, and the deviations (result − truth)/U."""

    result: AxisValues
    truth: Sequence[float]

    @property
    def deviations(self) -> list[float]:
        """The deviations (result − truth)/U of each axis."""
        rows = zip(self.result.values, self.truth, self.result.expanded, strict=True)
        return [(value - true) / u if u else float("nan") for value, true, u in rows]

    @property
    def truth_texts(self) -> list[str]:
        """The printed true value of each axis, with as many decimals as U."""
        return [format_with_u(true, u)[0] for true, u in zip(self.truth, self.result.expanded, strict=True)]


@dataclass(frozen=True, slots=True)
class TruthRow:
    """A row of the result with the truth; `scale` is None if no true scale factor is defined."""

    row: DisplayRow
    scale: TrueValues | None
    bias: TrueValues


def truth_rows(folder: Path, result: ResultDocument) -> list[TruthRow]:
    """Return the result's rows whose true values are in the run folder; empty without a valid file of the truth."""
    try:
        document = parse_json(read_regular_file(folder / TRUTH_FILE, SIZE_MAX_BYTES))
        truth = validate(_TruthFile, document, "truth")
    except (OSError, UnfitFile, ValueError, RecursionError):
        return []
    return [*_rows(truth, result)]


def _rows(truth: _TruthFile, result: ResultDocument) -> Iterator[TruthRow]:
    """Yield the displayed rows whose true values a simulated laboratory has written."""
    true_values: Mapping[str, Mapping[str, TrueGyroscope | TrueAccelerometer]] = {
        RATE.name: truth.gyroscopes,
        ACCELERATION.name: truth.accelerometers,
    }
    for row in shown(result):
        true = true_values.get(row.quantity.name, {}).get(row.sensor)
        if true is None or row.scale is None:
            continue
        bias = true.bias_rad_s if isinstance(true, TrueGyroscope) else true.bias_m_s2
        scale = None if true.scale is None else TrueValues(row.scale, true.scale)
        yield TruthRow(row, scale, TrueValues(row.numbers, [value / row.unit.size for value in bias]))


def truth_lines(rows: Sequence[TruthRow]) -> Iterator[str]:
    """Yield a line on the agreement of the result with the truth; nothing if there are no rows."""
    values = [
        (deviation, f"{row.row.name} {letter}{axis}")
        for row in rows
        for letter, true in (("k", row.scale), ("b", row.bias))
        if true is not None
        for deviation, axis in zip(true.deviations, row.row.labels, strict=True)
    ]
    if values:
        within = sum(abs(deviation) <= 1 for deviation, _ in values)
        farthest, name = max(values, key=lambda value: abs(value[0]))
        distance = format_signed(farthest, 2)
        yield f"simulated truth: {within} of {len(values)} values within U of it; farthest {name}, {distance} U"
