"""Parameter files of PX4 and ArduPilot: both know a gyroscope's offset and nothing else of its calibration.

PX4 (Gyroscope.hpp, Correct): R (data − thermal − offset). ArduPilot (AP_InertialSensor): INS_GYROFFS_X, …, replaced at
each boot unless INS_GYR_CAL is 0. Neither has a scale factor.
"""

from collections.abc import Iterator, Mapping

from rig.data.result_file import ResultDocument
from rig.report.exports.parameters import Exported, comments, exported

PX4_FLOAT = 9  # MAV_PARAM_TYPE_REAL32
HEADING = "# Offsets in rad/s, in each sensor's own axes: rate = reading - offset, offset = -b at zero gravity."
LOST = "Lost: scale factors, axes, g-sensitivity, accelerometer, uncertainties; there is no parameter for them."


def px4_files(result: ResultDocument) -> Mapping[str, str]:
    """`px4.params`, as QGroundControl loads it: vehicle, component, name, value, type, between tabs."""
    lines = [
        HEADING,
        f"# {LOST}",
    ]
    lines.append(
        "# Lost too: CAL_GYROn_ID, which only the vehicle knows; PX4 heeds an offset whose ID is its sensor's."
    )
    for index, each in enumerate(exported(result)):
        lines += _commented(result, each)
        for axis, offset in zip("XYZ", each.offset_rad_s.tolist(), strict=True):
            lines.append(f"1\t1\tCAL_GYRO{index}_{axis}OFF\t{offset!r}\t{PX4_FLOAT}")
    return {"px4.params": "\n".join(lines) + "\n"}


def ardupilot_files(result: ResultDocument) -> Mapping[str, str]:
    """`ardupilot.param`: name, value."""
    lines = [
        HEADING,
        f"# {LOST}",
    ]
    lines += ["# Without INS_GYR_CAL 0 ArduPilot finds offsets of its own at each boot.", "INS_GYR_CAL,0"]
    for index, each in enumerate(exported(result), start=1):
        lines += _commented(result, each)
        name = "INS_GYROFFS" if index == 1 else f"INS_GYR{index}OFFS"
        for axis, offset in zip("XYZ", each.offset_rad_s.tolist(), strict=True):
            lines.append(f"{name}_{axis},{offset!r}")
        lines.append(f"INS_GYR{index}_CALTEMP,{each.temperature_c!r}")
    return {"ardupilot.param": "\n".join(lines) + "\n"}


def _commented(result: ResultDocument, each: Exported) -> Iterator[str]:
    yield from (f"# {line}" for line in comments(result, each))
