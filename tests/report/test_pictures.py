"""A certificate's pictures: their bars hold what the caption says, and what they say is said by the budget."""

import numpy as np
import pytest

from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE
from rig.data.result_file import ResultDocument, VectorEntry, read_result
from rig.plans.recorded_run import judge_phases, open_run
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.svg_plots import (
    HEIGHT,
    Residuals,
    attitude_residuals,
    contributions,
    residuals,
)
from rig.report.document import document_of
from rig.report.findings.finding import Finding
from rig.report.findings.unexplained import EXPECTED, EXPECTED_IN_ATTITUDES, SAMPLE_SCATTER
from rig.report.words.printed_budget import lay_out_budget
from support.documents.certified import certificate, everything, read, result
from support.paths import RECORDINGS


def bars(picture: Residuals) -> np.ndarray:
    """(n, 3) in the picture's unit: half their heights."""
    (low, first), (high, second) = picture.ticks[0], picture.ticks[2]
    unit = (float(second.replace("−", "-")) - float(first.replace("−", "-"))) / (low - high)
    return unit * np.array([(point.low - point.high) / 2 for point in picture.points]).reshape(-1, 3)


def test_bars_of_sweeps_and_rests_are_what_the_solve_expects_of_them() -> None:
    sensor = result().gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry) and sensor.vector_model.residuals_std_rad_s is not None
    picture = residuals(Finding("gyro", RATE, sensor))
    assert picture is not None and picture.expectation == EXPECTED
    factor = {"mrad/s": 1e3, "µrad/s": 1e6}[picture.unit]
    expected = 2 * factor * np.array(sensor.vector_model.residuals_std_rad_s)
    np.testing.assert_allclose(bars(picture), expected, atol=0.01 * expected.max())
    assert EXPECTED in read(certificate()).text


def test_bars_of_solutions_without_a_model_of_their_scatter_are_called_what_they_are() -> None:
    sensor = read_result(RECORDINGS / "imu").gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry)
    alone = sensor.vector_model.model_copy(update={"residuals_std_rad_s": None})
    picture = residuals(Finding("gyro", RATE, sensor.model_copy(update={"vector_model": alone})))
    assert picture is not None and picture.expectation == SAMPLE_SCATTER
    assert "which includes vibration" in picture.expectation


@pytest.mark.slow
def test_bars_of_attitudes_are_what_the_solve_expects_of_them() -> None:
    document = document_of(judge_phases(open_run(RECORDINGS / "magnetometer"), DEFAULT_ESTIMATOR))
    (acceleration,), (field,) = document.accelerometers.values(), document.magnetometers.values()
    assert isinstance(field, MagnetometerEntry)
    pictures = (
        (
            attitude_residuals(Finding("imu", ACCELERATION, acceleration)),
            [dwell.residual_std_m_s2 for dwell in acceleration.dwells],
        ),
        (attitude_residuals(Finding("imu", FIELD, field)), [dwell.residual_std_t for dwell in field.dwells]),
    )
    for picture, expected in pictures:
        assert picture.expectation in (EXPECTED_IN_ATTITUDES[ACCELERATION], EXPECTED_IN_ATTITUDES[FIELD])
        told = 2 * np.array(expected, dtype=np.float64)
        drawn = bars(picture)
        np.testing.assert_allclose(drawn * (told.max() / drawn.max()), told, atol=0.02 * told.max())
        assert 0.85 * len(picture.points) <= picture.within


def test_frozen_attitudes_agree_with_their_bars() -> None:
    """By noise alone most of them seemed to have failed."""
    for name, kind in (("imu", "accelerometers"), ("magnetometer", "magnetometers")):
        document = read_result(RECORDINGS / name)
        for found in getattr(document, kind).values():
            picture = attitude_residuals(Finding("imu", ACCELERATION if kind == "accelerometers" else FIELD, found))
            assert picture.within >= 0.85 * len(picture.points)


def test_the_picture_of_contributions_is_of_the_values_of_the_budget() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    table = lay_out_budget(sensor.budget, sensor.scale, RATE.bias)
    picture = contributions(sensor.budget, sensor.scale)
    assert picture.axes == tuple(column.axis for column in table.columns)
    places = [column.index for column in table.columns]
    for name, _, *drawn in picture.rows:
        (line,) = (contributor for contributor in sensor.budget.contributors if contributor.name == name)
        for place, x in zip(places, drawn, strict=True):
            decades = np.log10(np.clip(line.std[place] / sensor.budget.std[place], 1e-4, 1.0))
            assert x == pytest.approx(332 + decades * (332 - 150) / 4, abs=0.1)
    heights = np.array([height for _, height, *_ in picture.rows])
    step = float(heights[1] - heights[0])
    assert step >= 13
    np.testing.assert_allclose(heights, picture.end - step * (np.arange(len(heights))[::-1] + 0.5))


def test_every_picture_has_words_of_its_own() -> None:
    page = read(certificate(everything()))
    assert HEIGHT > 0 and page.text.count("contain zero.") == 5
    assert "Contributions to the uncertainty of the scale factor of" in page.text


def filled(document: ResultDocument) -> list[float]:
    """How far down each printed sheet has lines, as a part of what it has room for."""
    from weasyprint import HTML

    parts = []
    for page in HTML(string=certificate_page(certificate(document))).render().pages:
        sheet = page._page_box
        lines = [descendant for descendant in sheet.children[0].descendants() if type(descendant).__name__ == "LineBox"]
        lowest = max(line.position_y + line.height for line in lines)
        parts.append((lowest - sheet.margin_top) / sheet.height)
    return parts


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["imu", "verified", "bias_drift", "everything"])
def test_no_sheet_but_the_last_is_left_half_empty(kind: str) -> None:
    document = everything() if kind == "everything" else read_result(RECORDINGS / kind)
    *before, _ = filled(document)
    assert before and min(before) > 0.7
