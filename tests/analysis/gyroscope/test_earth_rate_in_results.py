"""The Earth's rate in a calibration: asked for and not found, and as a person reads it."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.gyroscope.calibration import EARTH_RATE, SensorResult
from rig.config.load import ConfigurationRefused, load
from rig.data.recording.settings import settings_from_json
from rig.estimation.earth import DEG_H
from rig.estimation.gyroscope.earth_rate import EarthRate
from rig.report.entries.earth_rate import earth_rate_entry, earth_rate_lines
from rig.report.entries.gyroscope import sensor_entry
from rig.report.tables.axis_tables import decimals
from support.paths import CONFIGS
from support.recordings.synthetic_run import Setup, synthetic_run

SETUP = Setup(noise_rad_s=0.0019)
FIND = replace(SETUP, procedure=(("earth_rate", "find"),))


def solved(setup: Setup) -> SensorResult:
    return calibrate([synthetic_run(setup)]).results["gyro"]


@pytest.mark.slow
def test_a_part_that_cannot_find_it_is_calibrated_as_without() -> None:
    result, plain = solved(FIND), solved(SETUP)
    assert result.earth is None and EARTH_RATE in result.faults and EARTH_RATE not in plain.faults
    assert (result.scale == plain.scale).all() and (result.bias_rad_s == plain.bias_rad_s).all()
    assert result.uncertainty is not None and plain.uncertainty is not None
    assert (result.uncertainty.covariance == plain.uncertainty.covariance).all()
    said = sensor_entry(result).model_dump(mode="json", exclude_unset=True)
    assert said["earth_rate"]["error"].startswith(result.faults[EARTH_RATE].name)
    assert "earth_rate" not in sensor_entry(plain).model_dump(exclude_unset=True)


def test_what_was_asked_for_is_recorded() -> None:
    settings = synthetic_run(FIND).settings
    assert settings.finds_earth_rate
    assert settings_from_json(settings.to_json()) == settings
    assert not synthetic_run(SETUP).settings.finds_earth_rate


def test_a_person_reads_degrees_an_hour_and_where_the_arm_stands() -> None:
    rate = 15.041 * DEG_H * np.array([0.0, -np.cos(np.radians(40)), np.sin(np.radians(40))])
    found = EarthRate(rate, (0.05 * DEG_H) ** 2 * np.eye(3), np.array([0.0, 0.0, 1.0]), False, 1.0, 1e5)
    said = "\n".join(earth_rate_lines(earth_rate_entry(found)))
    assert "15.041 deg/h (± 0.100; expected 15.041)" in said
    assert "latitude 40.00° (± 0.38)" in said
    assert "270.00° from north" in said, "north is to the right of the x axis, which looks west"


def test_a_latitude_alone_serves_only_where_the_rate_is_found() -> None:
    alone = ["site.latitude_deg=38.8"]
    with pytest.raises(ConfigurationRefused) as caught:
        load(CONFIGS / "own_port" / "kvh1775.yaml", alone)
    assert any("latitude_deg and heading_deg, or neither" in problem for problem in caught.value.problems)
    load(CONFIGS / "own_port" / "kvh1775.yaml", [*alone, "procedure.earth_rate=find"])


def test_as_many_decimals_as_the_uncertainty_warrants() -> None:
    assert decimals([3e-7, 8e-7]) == 8
    assert decimals([3e-4, 1e-3]) == 5
    assert decimals([0.0]) == 5
