"""The stated uncertainty holds in sessions in which everything may be wrong, and does not without the remedies."""

import numpy as np
import pytest

from rig.study.budget import study
from rig.study.report import Settings


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.timeout(1800)
def test_the_stated_uncertainty_covers_the_truth(thorough: bool) -> None:
    draws = 1500 if thorough else 60
    found = study(Settings(runs=draws))
    coverage = np.array(found.columns["coverage_percent"]).reshape(2, 6)
    rms = np.array(found.columns["rms_error_over_u"]).reshape(2, 6)
    print(f"± U covers {coverage[0]} %, without the remedies {coverage[1]} %; RMS of error over u {rms[0]}")
    within = 2.0 if thorough else 9.0  # by chance alone they differ by 0.6 and 2.8
    assert np.all(np.abs(coverage[0] - 95) <= within)
    assert np.all(np.abs(rms[0] - 1) < (0.1 if thorough else 0.3))
    assert np.all(coverage[1] < 80)
