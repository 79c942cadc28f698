"""Full rates over the serial link: every conversion of every part arrives. For longer: benchmarks/throughput.py."""

import pytest

from support.full_rate import CASES, stream

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("case", "simulated_s"),
    [("three sensors", 10.0), ("one at 952 Hz", 10.0), ("all at their highest rates, calibrated", 2.0)],
)
def test_no_conversion_is_lost_at_full_rate(case: str, simulated_s: float) -> None:
    rates_hz, calibrated = CASES[case]
    result = stream(rates_hz, simulated_s, calibrated)
    assert result.complaints == []
    assert all(account.samples > 0.94 * simulated_s * account.rate_hz for account in result.accounts.values())
