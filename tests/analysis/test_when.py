"""Scale factors and biases say when they were read, how warm it was then, and how fast the sensor's own axes turned."""

import json
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.measurement_conditions import gyroscope_conditions
from rig.data.quantity import TEMPERATURE
from rig.data.recording.channel import make_stated_temperature_channel
from rig.data.recording.recorded_sensor import RecordedSensor, sensor_of
from rig.data.recording.run_data import RunData
from rig.motion.geometry import NOMINAL
from rig.plans.recorded_run import open_run
from rig.report.certificate.content import certificate_of
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.statements import StatedFacts
from rig.report.document import document_of
from rig.report.words.validity_words import load_words, when_words
from support.documents.certified import LABORATORY, read
from support.paths import RECORDINGS
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

COUNTS_PER_K = 16
PER_MINUTE_K = 3.0


def warming(run: RunData) -> RunData:
    """The same while its sensor warms up steadily."""
    samples = run.samples["gyro"].copy()
    minutes = (samples["board_time_us"] - samples["board_time_us"][0].astype(np.int64)) / 60e6
    samples["temperature_counts"] += np.round(COUNTS_PER_K * PER_MINUTE_K * minutes).astype(np.int64)
    return replace(run, samples={"gyro": samples})


def test_a_sensor_that_warms_up_has_its_scale_and_its_bias_conditions_the_temperatures_of_their_own_readings() -> None:
    run = warming(synthetic_run(Setup()))
    recordings = observe_recordings([run])
    held, seen = gyroscope_conditions(recordings, "gyro"), recordings[0].sensors["gyro"]
    started = datetime.fromisoformat(run.provenance.started_utc)
    first_s = float(recordings[0].motion.time_s[0])
    windows = [*(turn.average for turn in seen.revolutions), *seen.rests]
    assert held.bias.from_utc == started + timedelta(seconds=min(window.start_s for window in windows) - first_s)
    assert held.bias.to_utc == started + timedelta(seconds=max(window.end_s for window in windows) - first_s)
    assert held.bias.from_utc <= held.scale.from_utc < held.scale.mean_utc < held.scale.to_utc < held.bias.to_utc
    for each in (held.scale, held.bias):
        assert each.temperature_c is not None and each.temperature_range_c is not None
        since_min = (each.mean_utc - started).total_seconds() / 60
        assert each.temperature_c == pytest.approx(22 + PER_MINUTE_K * since_min, abs=0.1)
        assert each.temperature_range_c[1] - each.temperature_range_c[0] > 2
    assert held.scale.temperature_c != held.bias.temperature_c


def test_a_result_keeps_its_temperature_and_says_both_beside_it() -> None:
    document = document_of(calibrate([warming(synthetic_run(Setup()))]))
    sensor = document.gyroscopes["gyro"]
    assert sensor.scale_conditions is not None and sensor.bias_conditions is not None
    assert sensor.scale_conditions.temperature_c == pytest.approx(sensor.temperature_c)
    low, high = sensor.bias_conditions.temperature_range_c or (0.0, 0.0)
    assert f"between {low:.2f} and {high:.2f} °C" in when_words(sensor.bias_conditions)


def without_thermometer(run: RunData) -> RunData:
    """A recording of a sensor whose temperature was stated, by 22 °C and 5 K."""
    (sensor,), (samples,) = run.sensors.values(), run.samples.values()
    channels = [channel for channel in sensor.channels if channel.quantity != TEMPERATURE.name]
    samples = samples.copy()
    samples["temperature_counts"] = 0
    sensor = replace(sensor, channels=(*channels, make_stated_temperature_channel(22.0, 5.0)))
    return replace(run, sensors={"gyro": sensor_of(parsed_attributes(sensor))}, samples={"gyro": samples})


def parsed_attributes(sensor: RecordedSensor) -> dict[str, Any]:
    """What a run file keeps of a sensor."""
    attributes = sensor.attributes()
    return {**attributes, "channels": json.loads(attributes["channels"])}


def test_a_sensor_without_thermometer_is_certified_at_the_temperature_that_was_stated() -> None:
    document = document_of(calibrate([without_thermometer(synthetic_run(Setup(stated_kinematics=NOMINAL)))]))
    sensor = document.gyroscopes["gyro"]
    assert (
        sensor.bias_conditions is not None
        and sensor.bias_conditions.temperature_stated
        and sensor.temperature_c == 22.0
    )
    assert when_words(sensor.bias_conditions).startswith("at 22.0 °C, as stated, mean over")
    certificate = certificate_of(document, StatedFacts())
    said = " ".join(read(certificate).text.split())
    assert "Temperature and time, as stated; the item measured no temperature: scale factors at 22.0 °C" in said
    assert "Temperature: as stated; not traceable" in said and "own thermometer" not in said
    conditions = digital_certificate(certificate_of(document, LABORATORY)).decode()
    assert "temperature of the item at the biases, as stated" in conditions and "own thermometer" not in conditions


def test_an_accelerometer_s_scale_and_bias_refer_to_the_stated_temperature() -> None:
    run = open_run(RECORDINGS / "imu").movement[0]
    result = calibrate([warming(run)])
    entry, found = document_of(result).accelerometers["gyro"], result.accelerometers["gyro"]
    assert entry.conditions is not None and entry.temperature_c is not None
    assert entry.temperature_c == pytest.approx(entry.conditions.temperature_c)
    dwells_c, own = [dwell.temperature_c for dwell in found.dwells], found.movement.sensor_errors
    assert own is not None and abs(entry.temperature_c - float(np.mean(dwells_c))) > 0.1
    np.testing.assert_allclose(own.warmer_k[: len(dwells_c)], np.subtract(dwells_c, entry.temperature_c))


def test_what_was_recorded_again_was_read_when_it_was_recorded_last() -> None:
    first, again = (synthetic_run(Setup(seed=seed)) for seed in (1, 2))
    later = datetime.fromisoformat(first.provenance.started_utc) + timedelta(hours=2)
    again = replace(again, provenance=replace(again.provenance, started_utc=later.isoformat()))
    held = gyroscope_conditions(observe_recordings([first, again]), "gyro")
    assert later < held.bias.from_utc < held.bias.to_utc < later + timedelta(minutes=3)


def test_axes_that_lean_are_loaded_with_less_than_the_speed_of_the_sweeps() -> None:
    lean = np.radians(12)
    result = calibrate([synthetic_run(Setup(noise_rad_s=0.002, mounting_error_rad=(float(lean), 0.0, 0.0)))])
    explained = result.results["gyro"].explained
    assert explained is not None
    upright, *leaning = np.degrees(explained.axis_rate_ranges_rad_s).tolist()
    assert upright == pytest.approx([60, 60], rel=1e-3)  # what turns it across that axis tells nothing of it
    for each in leaning:
        assert each == pytest.approx([60 * float(np.cos(lean))] * 2, rel=2e-3)
    assert load_words(document_of(result).gyroscopes["gyro"]) == "x 60.0, y 58.7, z 58.7"


def test_aligned_axes_have_the_speed_of_the_sweeps_and_no_rates_of_their_own_are_stated() -> None:
    result = calibrate([synthetic_run(Setup(mounting_error_rad=(0.0, 0.0, 0.0)))])
    assert load_words(document_of(result).gyroscopes["gyro"]) is None
