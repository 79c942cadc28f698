"""Numbers that a configuration is refused by are those that its recording is judged by, where each room has its own."""

from rig.config.judging import judging_sections
from rig.config.procedures import procedure_sections
from rig.estimation.gyroscope import earth_rate
from rig.estimation.temperature import over_temperature


def test_a_configuration_is_refused_by_the_numbers_that_its_recording_would_be() -> None:
    assert procedure_sections.MIN_RANGE_C == over_temperature.MIN_RANGE_C
    assert judging_sections.MIN_LEVEL_SINE == earth_rate.MIN_LEVEL_SINE
