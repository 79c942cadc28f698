"""The readings and rows of files that a solution leaves out, and notes on how the files were read."""

from collections.abc import Iterator, Mapping

import numpy as np

from rig.analysis.external.attitudes import AttitudeCalibration, Result
from rig.analysis.external.increment_calibration import IncrementCalibration
from rig.analysis.installed_solvers import OfKind
from rig.data.quantity import RATE, Quantity
from rig.data.recording.motion_file import ExternalReadings
from rig.estimation.arrays import Array
from rig.estimation.external.row_changes import MAX_ROWS
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.gyroscope.rotations_by_angle import TurnedSolution
from rig.observation.external.attitude_import import PlacedReadings
from rig.observation.external.csv_import import QUARTER_DEG, ExternalData
from rig.observation.external.csv_samples import Samples
from rig.observation.external.omission import Omitted
from rig.observation.external.placements import Placements

MAX_ERROR = 2e-3  # relative, of the time that a sweep lasts
UNUSUAL_SCALE_RATIO = 1.6  # of all axes; datasheets state less than a tenth of this deviation from 1
NOISE_LIMIT_RAD_S = 0.04  # standard deviation of single readings, 2.3 °/s: SIX states 0.035 rad/s for an LSM9DS1


def list_omitted(
    placed: PlacedReadings, results: Mapping[Quantity, Result | OfKind]
) -> Iterator[tuple[Quantity | None, Omitted]]:
    """Yield the readings left out of a solution in attitudes, each after the quantity concerned, None for all."""
    yield from ((None, omitted) for omitted in placed.omitted)
    rates = results.get(RATE)
    # A solution by increments omits increments; one by means in attitudes omits rows in which samples are missing.
    if isinstance(rates, IncrementCalibration | AttitudeCalibration):
        yield from (
            (RATE, one) for one in (rates.omitted if isinstance(rates, IncrementCalibration) else placed.incomplete)
        )
    solved = [quantity for quantity in results if quantity != RATE]
    # All other quantities have the same placements, so their omissions are listed once, with the first quantity.
    if isinstance(placed.placements, Placements) and solved:
        yield from ((solved[0], omitted) for omitted in placed.placements.omitted)


def notes_on_reading(read: ExternalReadings, samples: Samples) -> Iterator[str]:
    """Yield notes for the user: the instant from which times count, and rows that were changed or left out."""
    if read.note:
        yield read.note
    yield from samples.notes
    if read.origin_s:
        yield f"times count from {read.origin_s} s of the files' clock"
    if read.other_rows:
        yield f"{read.other_rows} rows of the samples do not contain these readings and are left out"


def notes_on_speeds(data: ExternalData) -> Iterator[str]:
    """Yield a note if speeds look like °/s; if the readings are in °/s too, only the bias is wrong."""
    fastest = max((sweep.speed_rad_s for sweep in data.sweeps), default=0.0)
    remedy = "if both files are in °/s, state that unit with --columns, because the bias depends on it"
    if RATE.mistaken is not None and fastest > RATE.mistaken.unusual:
        yield (
            f"the sweeps turn at up to {fastest:.4g} rad/s ({np.degrees(fastest):.4g} °/s), faster than most "
            f"gyroscopes can read: {remedy}"
        )
        return
    turned = np.array([sweep.speed_rad_s * (sweep.average.end_s - sweep.average.start_s) for sweep in data.sweeps])
    if _are_whole(turned, QUARTER_DEG) and not _are_whole(turned, 2 * np.pi):
        yield f"each sweep turns by a whole multiple of 90 rad, as turns in degrees do: {remedy}"
    # A sweep also shows what the body does on its way, a rest only the sensor.
    averages = data.all_rests or tuple(sweep.average for sweep in data.sweeps)
    noise_rad_s = float(np.median([average.noise_rad_s for average in averages]))
    if noise_rad_s > NOISE_LIMIT_RAD_S:
        yield f"the readings scatter by {noise_rad_s:.2g} rad/s, more than those of a gyroscope do: {remedy}"


def notes_on_scale(scale: Array) -> Iterator[str]:
    """Yield a note if all scale factors (3,) are far above 1 or far below, as if half turns were stated as whole."""
    if np.all(scale > UNUSUAL_SCALE_RATIO) or np.all(scale < 1 / UNUSUAL_SCALE_RATIO):
        yield (
            f"the scale factors are near {np.median(scale):.2g}, and those of readings in rad/s near 1: check the "
            "stated angles or speeds (half turns given as whole ones?) and the sensor's range"
        )


def _are_whole(turned: Array, part: float) -> bool:
    """Return whether all angles `turned` (k,) are nonzero multiples of `part`; False if there are no angles."""
    multiples = np.rint(turned / part)
    return bool(len(turned) and (multiples > 0).all() and (np.abs(turned / part / multiples - 1) < MAX_ERROR).all())


def notes_on_changes(data: ExternalData) -> Iterator[str]:
    """Yield a note if there are too many rows to search for an abrupt change of the sensor."""
    count = len(data.sweeps) + len(data.all_rests)
    if count > MAX_ROWS:
        yield (
            f"abrupt changes of the sensor were not searched for: there are {count} rows of sweeps and rests, and the "
            f"search takes up to {MAX_ROWS}"
        )


def notes_on_turns(data: ExternalData, solution: Estimate) -> Iterator[str]:
    """Yield a note if turns with an angle were solved from their mean speed, because they do not lie between rests."""
    if not data.by_mean:
        return
    why = (
        "the body moves before or after them; so angle_rad must be the angle from start_s to end_s, without these moves"
    )
    if isinstance(solution, TurnedSolution):
        rows = ", ".join(map(str, data.by_mean))
        yield f"{len(data.by_mean)} of {len(data.sweeps)} turns, rows {rows}, count by their mean speed: {why}"
    else:
        yield f"all {len(data.sweeps)} turns count by their mean speed: {why}"
