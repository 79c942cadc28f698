"""Biases exported for another temperature: inside the range that a drift run has seen, and nowhere else."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.cli import main
from rig.data.entries.bias_drift import DriftEntry, SlopeEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.result_file import ResultDocument, write_result
from rig.errors import Refused
from rig.report.exports.exported_corrections import calibrations
from rig.report.exports.temperature import move_to_temperature
from support.documents.certified import accelerometer, result

ENDLESS = (None, None, None)
SLOPE = (2e-4, -1e-4, 5e-5)  # per °C, of the readings


def watched(range_c: tuple[float, float] = (18.0, 31.0), **changes: Any) -> ResultDocument:
    """A drift run's result, of the gyroscope that `result` calibrates at 22 °C and the accelerometer beside it."""
    zero = (0.0, 0.0, 0.0)
    slope = SlopeEntry(slope=SLOPE, std=zero, range_c=range_c, correlation_with_time=0.1, degrees_of_freedom=ENDLESS)
    entry = DriftEntry(
        unit="",
        repeats=(),
        common_std=zero,
        scatter_ratio=zero,
        steps=(),
        false_alarm_probability=0.02,
        largest_change=zero,
        temperature_slope=slope,
        earth_rate_known=True,
        degrees_of_freedom=ENDLESS,
        part="lsm9ds1",
        serial_number="LSM9DS1-001",
        full_scale=4.276,
        temperature_stated=False,
    ).model_copy(update=changes)
    return result().model_copy(update={"bias_drift": {"gyro": {"rate": entry, "acceleration": entry}}})


def test_biases_move_along_the_slope_and_the_readings_corrected_by_them_do_not() -> None:
    beside = accelerometer().model_copy(update={"temperature_c": 22.0})
    before = calibrations(result().model_copy(update={"accelerometers": {"gyro": beside}}))
    after = move_to_temperature(before, watched(), 30.0)
    assert [sensor.temperature_c for sensor in after.sensors] == [30.0, 30.0]
    warmer = np.array(SLOPE) * 8.0  # what every reading gains
    for old, new in zip(before.sensors, after.sensors, strict=True):
        assert old.quantity == new.quantity and old.offset + warmer == pytest.approx(new.offset)


@pytest.mark.parametrize(("range_c", "wanted_c"), [((18.0, 31.0), 31.5), ((18.0, 31.0), -5.0), ((24.0, 31.0), 30.0)])
def test_outside_of_what_was_seen_it_is_refused(range_c: tuple[float, float], wanted_c: float) -> None:
    with pytest.raises(Refused, match="only") as refused:
        move_to_temperature(calibrations(result()), watched(range_c), wanted_c)
    assert refused.value.name == "temperature_outside"


def test_a_run_that_tells_no_slope_or_watched_another_sensor_is_refused() -> None:
    confounded = watched(temperature_slope=ErrorEntry(error="temperature_and_time_confounded: it warmed up"))
    for drift in (confounded, result()):
        with pytest.raises(Refused) as refused:
            move_to_temperature(calibrations(result()), drift, 25.0)
        assert refused.value.name == "temperature_slope_unknown"
    made = watched().provenance.model_copy(update={"sensor_serial_numbers": {"gyro": "another"}})
    with pytest.raises(Refused) as refused:
        move_to_temperature(calibrations(result()), watched().model_copy(update={"provenance": made}), 25.0)
    assert refused.value.name == "another_sensor"


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, document in (("run", result()), ("drift", watched())):
        (tmp_path / name).mkdir()
        write_result(document, tmp_path / name)

    def export(*arguments: str) -> int:
        return main(["export", str(tmp_path / "run"), *arguments])

    drift = str(tmp_path / "drift")
    assert export("--format", "px4", "--at-temperature", "30", drift) == 0
    (written,) = capsys.readouterr().out.splitlines()
    assert "30.0 degC" in Path(written).read_text(encoding="utf-8")
    for options in (("px4", "45", drift), ("px4", "warm", drift), ("csv", "30", drift)):
        assert export("--format", options[0], "--at-temperature", *options[1:]) == 2
    said = capsys.readouterr().err
    assert "temperature_outside" in said and said.count("bad_option") == 2
