"""Rate and losses of logs whose stamps are rounded, or those of arrival, with everything that may happen to them."""

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.observation.external.csv_samples import samples_in
from rig.observation.time_stamps.even_times import find_sampling_times
from rig.observation.time_stamps.sampling import find_sampling
from support.external.loggers import Stamps

COUNT = 6000
ROUNDED = [(rate, Stamps(rounded_s=1e-3)) for rate in (50, 104, 119, 238, 416, 476, 952)]
FINE = [(rate, Stamps(rounded_s=1e-6)) for rate in (100, 1600, 4000)]
BURSTS = [(rate, Stamps(burst=burst, inner_s=4e-4)) for rate in (50, 100, 400) for burst in (2, 3, 5, 8, 13, 20)]
LATE = [(100, Stamps(burst=burst, late_s=late_s)) for burst, late_s in ((2, 0.01), (5, 0.02), (10, 0.05))]


def taken(rate_hz: float, count: int = COUNT) -> np.ndarray:
    return np.arange(count) / rate_hz


@pytest.mark.parametrize("count", [20, 50, 110])
def test_few_readings_at_random_times_have_their_mean_interval(count: int) -> None:
    stamped_s = np.cumsum(np.random.default_rng(count).exponential(0.01, count))
    found = find_sampling(stamped_s)
    assert found.interval_s == pytest.approx(np.diff(stamped_s).mean()) and not found.missing.any()


def test_a_window_expects_the_readings_of_its_duration_within_the_recording_and_beyond_it() -> None:
    time_s = taken(100.0, 1000)
    windows_s = np.array([(0.0, 9.99), (2.0, 3.0), (-1.0, 1.0), (9.0, 12.0)])
    assert find_sampling(time_s).count_expected(time_s, windows_s) == pytest.approx([999, 100, 200, 300])


@pytest.mark.parametrize(("rate_hz", "stamps"), ROUNDED + FINE + BURSTS + LATE)
def test_nothing_is_lost_where_stamps_are_only_bad(rate_hz: float, stamps: Stamps) -> None:
    count = COUNT - COUNT % stamps.burst  # whole packets
    stamped_s, _ = stamps.stamp(taken(rate_hz, count))
    found = find_sampling(stamped_s)
    assert found.interval_s == pytest.approx(1 / rate_hz, rel=1e-3)
    assert found.missing.sum() <= 1e-3 * count and found.scattered == 0
    expected = found.count_expected(stamped_s, stamped_s[[[0, -1]]])
    assert expected[0] == pytest.approx(count - 1, abs=4)


@pytest.mark.parametrize(
    ("rate_hz", "stamps"),
    [
        *((rate, Stamps(rounded_s=1e-3, lost=0.04)) for rate in (50, 104, 238, 416, 476, 952)),
        *((rate, Stamps(rounded_s=1e-6, lost=0.04)) for rate in (104, 1600)),
        *((100, Stamps(burst=burst, lost=0.04)) for burst in (2, 3, 5, 8, 20)),
        (104, Stamps(rounded_s=1e-3, lost=0.01)),
        (833, Stamps(rounded_s=1e-3, lost=0.01)),
    ],
)
def test_real_losses_are_found_at_bad_stamps(rate_hz: float, stamps: Stamps) -> None:
    stamped_s, kept = stamps.stamp(taken(rate_hz))
    found, lost = find_sampling(stamped_s), 1 - kept.mean()
    missing = found.missing.sum() / COUNT + found.scattered
    assert 0.6 * lost < missing < 2.5 * lost, "their number is known where stamps tell it, else about"


@pytest.mark.parametrize(
    ("rate_hz", "stamps"),
    [
        (119, Stamps(rounded_s=1e-3, gaps=((3000, 1),))),
        (952, Stamps(rounded_s=1e-3, gaps=((3000, 3),))),
        (952, Stamps(rounded_s=1e-3, gaps=((1000, 300), (4000, 2)))),
        (100, Stamps(burst=5, gaps=((3001, 1),))),
        (100, Stamps(burst=5, gaps=((3000, 5), (4000, 10)))),
        (100, Stamps(burst=20, gaps=((3007, 4),))),
        (100, Stamps(gaps=((1000, 400), (2000, 400), (5000, 1)))),
    ],
)
def test_a_gap_is_where_it_is(rate_hz: float, stamps: Stamps) -> None:
    stamped_s, _ = stamps.stamp(taken(rate_hz))
    found = find_sampling(stamped_s)
    lost = sum(count for _, count in stamps.gaps)
    assert found.missing.sum() == pytest.approx(lost, abs=2)
    before = 0
    for first, count in stamps.gaps:
        around = found.missing[first - before - 25 : first - before + 25].sum()
        assert around == pytest.approx(count, abs=1), "within a packet of where it is"
        before += count


@pytest.mark.parametrize("burst", [2, 5, 20])
def test_readings_that_arrive_together_were_taken_one_after_the_other(burst: int) -> None:
    time_s = taken(100)
    stamped_s, _ = Stamps(burst=burst).stamp(time_s)
    even_s = find_sampling_times(stamped_s, find_sampling(stamped_s))
    off_s = even_s - time_s
    assert np.ptp(off_s) < 1e-3, "but for a latency that they all have"
    assert np.ptp(stamped_s - time_s) > 0.008


def test_a_clock_that_runs_differently_loses_nothing() -> None:
    """An oscillator that warms up by 2 %."""
    time_s = np.cumsum(0.01 * (1 + 0.02 * np.linspace(0, 1, COUNT)))
    assert not find_sampling(time_s).missing.any()
    rounded_s = np.rint(1e3 * time_s) / 1e3
    assert not find_sampling(rounded_s).missing.any()


def test_a_few_long_gaps_are_no_bursts() -> None:
    """Six short logs, joined."""
    time_s = (4.9 * np.arange(6)[:, None] + np.arange(120) / 63).ravel()
    found = find_sampling(time_s)
    assert found.interval_s == pytest.approx(1 / 63, rel=1e-6) and np.count_nonzero(found.missing) == 5
    assert (find_sampling_times(time_s, found) == time_s).all()


@pytest.mark.slow
def test_stamps_too_uneven_to_count_losses_say_so() -> None:
    rng = np.random.default_rng(51)
    arrived_s = np.maximum.accumulate(taken(100) + rng.exponential(0.015, size=COUNT)) + 1e-6 * np.arange(COUNT)
    lost = rng.choice(COUNT, size=COUNT // 60, replace=False)[:, None] + np.arange(3)
    stamps_s = np.asarray(np.delete(arrived_s, np.minimum(lost, COUNT - 1).ravel()), dtype=np.float64)
    readings = rng.normal(size=(3, len(stamps_s)))
    samples = samples_in({"time_s": stamps_s, **dict(zip(RATE.columns, readings, strict=True))}, "log.csv")
    assert samples.sampling is not None and samples.sampling.hides_losses
    assert any("too uneven to show which readings are missing" in note for note in samples.notes)
