"""A bias by repeat as `result.json` has it."""

from rig.analysis.bias_drift import Anew, BiasDrift
from rig.data.drift_entries import BiasEntry, DriftEntry, MoveEntry, RepeatEntry, SlopeEntry
from rig.data.quantity import Quantity
from rig.data.recorded_sensor import RecordedSensor
from rig.data.result_types import ErrorEntry, Vector3
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.bias_by_repeat import FALSE_ALARM
from rig.report.entry import counted


def drift_entry(quantity: Quantity, drift: BiasDrift, sensor: RecordedSensor) -> DriftEntry:
    """The bias of that sensor by repeat, in SI units."""
    held, slope = drift.held, drift.over_temperature
    return DriftEntry(
        unit=quantity.unit,
        repeats=tuple(
            RepeatEntry(
                time_s=float(drift.time_s[repeat]),
                temperature_c=float(drift.temperature_c[repeat]),
                held=BiasEntry(bias=_vector(held.bias[repeat]), std=_vector(held.std[repeat])),
                anew=_anew(drift.anew[repeat]),
            )
            for repeat in range(len(held.bias))
        ),
        common_std=_vector(drift.common_std),
        excess=_vector(held.excess),
        moves=tuple(
            MoveEntry(repeat=move.repeat + 1, axis="xyz"[move.axis], change=_vector(move.change), std=_vector(move.std))
            for move in held.moves
        ),
        false_alarm=FALSE_ALARM,
        largest_change=_vector(held.largest_change),
        over_temperature=ErrorEntry(error=str(slope))
        if isinstance(slope, Fault)
        else SlopeEntry(
            slope=_vector(slope.slope),
            std=_vector(slope.std),
            range_c=slope.range_c,
            correlation_with_time=slope.correlation,
            freedom=counted(drift.slope_freedom),
        ),
        earth_rate_known=drift.earth_rate_known,
        freedom=counted(drift.freedom),
        part=sensor.part,
        serial_number=sensor.serial_number,
        full_scale=sensor.channel(quantity).range,
    )


def _anew(anew: Anew | Fault) -> BiasEntry | ErrorEntry:
    if isinstance(anew, Fault):
        return ErrorEntry(error=str(anew))
    return BiasEntry(bias=_vector(anew.bias), std=_vector(anew.std))


def _vector(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z
