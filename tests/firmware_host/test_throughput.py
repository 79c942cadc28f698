"""Full rates over the serial link: every conversion arrives. For longer: benchmarks/wire/throughput.py."""

import pytest

from support.board.emulated_session import RANGE_G
from support.board.full_rate import CASES, stream

pytestmark = pytest.mark.slow


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("case", "simulated_s"),
    [("three sensors", 4.0), ("one at 952 Hz", 4.0), ("all at their highest rates, calibrated", 2.0)],
)
def test_no_conversion_is_lost_at_full_rate(case: str, simulated_s: float) -> None:
    rates_hz, calibrated = CASES[case]
    result = stream(rates_hz, simulated_s, calibrated)
    assert result.complaints == []
    assert all(account.samples > 0.94 * simulated_s * account.rate_hz for account in result.accounts.values())


@pytest.mark.thorough
@pytest.mark.parametrize(
    "rates_hz",
    [
        {"lsm9ds1": 238.0, "mpu9250": 200.0, "adis16465": 200.0},
        {"lsm9ds1": 952.0, "mpu9250": 1000.0, "adis16465": 1000.0},
    ],
    ids=["usual", "highest at which outputs are averages"],
)
def test_no_conversion_with_its_accelerations_is_lost(rates_hz: dict[str, float]) -> None:
    result = stream(rates_hz, 3.0, range_g=RANGE_G)
    assert result.complaints == []
    assert all(account.samples > 0.9 * 3.0 * account.rate_hz for account in result.accounts.values())
