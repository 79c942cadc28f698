"""What a certificate says of sweeps that were no whole turns: no circle closes, and time is not the only standard."""

import numpy as np
import pytest

from rig.data.result_file import ResultDocument
from rig.report.certificate.dcc import digital_certificate
from support.documents.certified import add_comparison, certificate, read, result
from support.documents.dcc_rules import schema_faults

pytestmark = pytest.mark.slow


def of_arcs(angle_rad: float) -> ResultDocument:
    sensor = result().gyroscopes["gyro"]
    turned = tuple(observation.model_copy(update={"angle_rad": angle_rad}) for observation in sensor.observations)
    return add_comparison(
        result().model_copy(update={"gyroscopes": {"gyro": sensor.model_copy(update={"observations": turned})}})
    )


def test_whole_turns_close() -> None:
    for turns in (1, 3):
        found = certificate(of_arcs(2 * np.pi * turns))
        assert "a whole turn is 2π by closure of the circle" in read(found).text
        assert "whole turns, 2π by closure of the circle" in digital_certificate(found).decode()


def test_the_encoders_determine_arcs_and_no_traceability_is_claimed() -> None:
    found = certificate(of_arcs(np.pi))
    text, xml = read(found).text, digital_certificate(found).decode()
    assert certificate(of_arcs(2 * np.pi)).traceable and not found.traceable
    assert "turns by 180°, by the turner's encoders; not traceable, a contributor of the uncertainty" in text
    assert "the encoders determine the angles of the sweeps" in text
    assert "180° by the turner's encoders, whose error is in the uncertainty budget" in xml
    assert "turns by 180° and attitudes at rest on a robot arm" in xml
    assert "closure of the circle" not in text + xml
    assert schema_faults(digital_certificate(found)) == []
