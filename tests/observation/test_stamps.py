"""Stamps of other loggers put in order: what is left out, what is stamped anew, and the times that come out."""

from collections.abc import Callable

import numpy as np
import pytest

from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.time_stamps.stamp_order import OrderedStamps, order_stamps
from support.external.loggers import Stamps, polled, stale_at_first, stalled

COUNT, RATE_HZ = 3000, 104.0


def taken(rate_hz: float = RATE_HZ) -> Array:
    return np.arange(COUNT) / (1.0007 * rate_hz)


def readings(count: int = COUNT) -> Array:
    return np.random.default_rng(5).normal(size=(count, 3))


def ordered(stamps_s: Array) -> OrderedStamps:
    return order_stamps(stamps_s, readings(len(stamps_s)))


def off_s(found: OrderedStamps, time_s: Array) -> float:
    """The standard deviation of the times, but for a latency that they all have."""
    return float(np.std(found.time_s - time_s[found.rows]))


def float32(time_s: Array) -> Array:
    return np.asarray((time_s + 1e5).astype(np.float32), dtype=np.float64)


ONLY_BAD: list[tuple[float, Callable[[Array], Array], float]] = [
    (104, lambda t: np.round(t, 3), 1e-3),
    (119, lambda t: np.floor(1e3 * t) / 1e3, 1e-3),
    (833, lambda t: np.round(t, 3), 1e-3),
    (952, lambda t: np.round(t, 3), 1e-3),
    (50, lambda t: np.round(t, 2), 3e-3),
    (104, lambda t: np.round(t, 2), 1e-3),
    (238, lambda t: np.round(t, 2), 1e-3),
    (100, float32, 1e-3),
    (952, float32, 1e-3),
    (100, lambda t: polled(t, 0.02), 6e-3),
    (104, lambda t: polled(t, 0.02, late_s=3e-3), 3e-3),
    (100, lambda t: polled(t, 0.008), 1e-3),
    (104, lambda t: polled(t, 0.008, late_s=3e-3), 2e-3),
    (200, lambda t: polled(t, 0.05, inner_s=1e-4), 2e-3),
    (100, lambda t: np.maximum.accumulate(t + np.random.default_rng(1).exponential(0.005, len(t))), 1e-3),
    (70, lambda t: np.maximum.accumulate(t + np.random.default_rng(1).exponential(0.002, len(t))), 1e-3),
]


@pytest.mark.parametrize(("rate_hz", "stamp", "nearest_s"), ONLY_BAD)
def test_bad_stamps_lose_nothing_and_rise(rate_hz: float, stamp: Callable[[Array], Array], nearest_s: float) -> None:
    time_s = taken(rate_hz)
    found = ordered(stamp(time_s))
    assert len(found.rows) == COUNT and not found.findings
    assert found.sampling.missing.sum() <= 1 and found.sampling.scattered == 0
    assert found.sampling.interval_s == pytest.approx(1 / (1.0007 * rate_hz), rel=5e-4)
    assert (np.diff(found.time_s) > 0).all() and off_s(found, time_s) < nearest_s


@pytest.mark.parametrize("rate_hz", [60.0, 200.0])
def test_stamps_in_whole_seconds_are_used(rate_hz: float) -> None:
    found = ordered(np.floor(taken(rate_hz)))
    assert found.sampling.interval_s == pytest.approx(1 / (1.0007 * rate_hz), rel=0.2)
    assert found.sampling.scattered < 0.01 and (np.diff(found.time_s) > 0).all()


@pytest.mark.parametrize("lost", [0.005, 0.02, 0.04])
def test_losses_are_counted_behind_the_rounding(lost: float) -> None:
    stamped_s, kept = Stamps(rounded_s=1e-3, lost=lost).stamp(taken())
    found = ordered(stamped_s)
    assert found.sampling.missing.sum() == pytest.approx(COUNT - kept.sum(), abs=2)


@pytest.mark.parametrize("every_s", [0.02, 0.008])
def test_a_gap_is_no_burst(every_s: float) -> None:
    time_s = taken()
    kept = (time_s < 20) | (time_s > 20.17)
    found = ordered(polled(time_s, every_s)[kept])
    assert found.sampling.missing.sum() == pytest.approx(np.count_nonzero(~kept), abs=2)
    longest = int(np.argmax(found.sampling.missing))
    assert longest == pytest.approx(np.searchsorted(time_s, 20), abs=3)


@pytest.mark.parametrize("rate_hz", [70.0, 104.0, 150.0])
@pytest.mark.parametrize("jitter_s", [0.0, 0.002])
def test_stale_readings_at_the_start_are_left_out(rate_hz: float, jitter_s: float) -> None:
    time_s, count = taken(rate_hz), 600
    jitter = np.random.default_rng(2).exponential(jitter_s, COUNT) if jitter_s else 0.0
    found = ordered(np.maximum.accumulate(stale_at_first(time_s, count) + jitter))
    (stale,) = (finding for finding in found.findings if finding.left_out)
    assert stale.count == pytest.approx(count, abs=10) and "every 2.5 ms" in stale.reason
    assert str(stale).startswith("sample 1, at ")
    assert found.sampling.interval_s == pytest.approx(1 / (1.0007 * rate_hz), rel=1e-3)
    assert off_s(found, time_s) < 1e-3


@pytest.mark.parametrize("lasts_s", [0.15, 0.7])
def test_a_link_that_stalls_loses_nothing(lasts_s: float) -> None:
    time_s = taken()
    found = ordered(stalled(time_s, 20.0, lasts_s))
    (waited,) = found.findings
    assert not waited.left_out and waited.count == pytest.approx(lasts_s * RATE_HZ, rel=0.15)
    assert waited.sample == pytest.approx(1 + np.searchsorted(time_s, 20.0), abs=1)
    assert not found.sampling.missing.any() and np.abs(found.time_s - time_s).max() < 0.02


def test_rows_that_repeat_another_one_are_left_out() -> None:
    rows = np.sort(np.concatenate([np.arange(COUNT), [101, 500, 2000]]))
    found = order_stamps(taken()[rows], readings()[rows])
    (repeated,) = found.findings
    assert repeated.left_out and repeated.count == 3 and repeated.sample == 103
    assert not found.sampling.missing.any() and len(found.rows) == COUNT


def test_a_packet_that_was_sent_twice_is_left_out_once() -> None:
    stamps_s = polled(taken(), 0.05)
    rows = np.concatenate([np.arange(500), np.arange(495, COUNT)])
    found = order_stamps(stamps_s[rows], readings()[rows])
    assert [finding.count for finding in found.findings] == [5] and not found.sampling.missing.any()


def test_a_second_reading_of_one_stamp_needs_a_time_of_its_own() -> None:
    time_s = np.arange(COUNT) / 100 + 1e-5 * np.random.default_rng(1).random(COUNT)
    more = ordered(np.insert(time_s, 1000, time_s[1000]))
    assert [(finding.count, finding.left_out) for finding in more.findings] == [(1, True)]
    late = time_s.copy()
    late[1000] = late[999]
    found = ordered(late)
    assert [(finding.count, finding.left_out) for finding in found.findings] == [(1, False)]
    assert not found.sampling.missing.any() and off_s(found, time_s) < 1e-4


@pytest.mark.parametrize("lasts", [12, 700])
def test_readings_that_a_stopped_link_repeats_are_no_readings(lasts: int) -> None:
    values = readings() + 500 * np.sin(taken())[:, None]  # a moving body: the readings jump when the link goes on
    values[900 : 900 + lasts] = values[900]
    found = order_stamps(taken(), values)
    assert [(finding.count, finding.sample, finding.left_out) for finding in found.findings] == [(lasts - 1, 902, True)]
    assert found.sampling.missing.sum() == lasts - 1
    coarse = np.rint(values / 200)
    assert not order_stamps(taken(), coarse).findings, "there readings repeat anyway"


def test_rows_in_another_order_are_put_in_order() -> None:
    rows = np.arange(COUNT)
    rows[100:110] = [*range(105, 110), *range(100, 105)]
    found = order_stamps(taken()[rows], readings()[rows])
    assert (rows[found.rows] == np.arange(COUNT)).all() and found.time_s == pytest.approx(taken())
    assert [(finding.count, finding.sample) for finding in found.findings] == [(5, 106)]


@pytest.mark.parametrize("back_s", [0.05, 1.3, 60.0, 3600.0])  # the last two are near the periods of counters
def test_a_clock_that_was_set_back_is_named_with_row_and_time(back_s: float) -> None:
    stamps_s = np.where(np.arange(COUNT) < 2500, taken(), taken() - back_s)
    with pytest.raises(Refused, match=f"sample 2501: the clock was set back by about {back_s:g} s"):
        ordered(stamps_s)


def test_a_clock_that_stands_still_is_named() -> None:
    with pytest.raises(Refused, match="time_not_increasing: the samples has the time 17 s in all of its 3000 samples"):
        ordered(np.full(COUNT, 17.0))


@pytest.mark.parametrize(
    ("unit_s", "period"), [(1e-6, 2.0**32), (1e-3, 2.0**16), (1.0, 86_400.0)], ids=["us-32", "ms-16", "midnight"]
)
def test_counters_that_wrap_go_on(unit_s: float, period: float) -> None:
    time_s = taken(20.0)
    counter = np.mod(time_s / unit_s + period - 20 / unit_s, period)
    found = ordered(unit_s * (counter if unit_s == 1 else np.floor(counter)))
    assert not found.sampling.missing.any() and np.ptp(found.time_s) == pytest.approx(np.ptp(time_s), abs=2e-3)
    assert all("restarts" in finding.reason and not finding.left_out for finding in found.findings)


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_a_first_row_without_a_reading_is_left_out(nothing: float) -> None:
    values, stamps_s = readings(), 1700 + taken()
    values[0], stamps_s[0] = nothing, 0.0
    found = order_stamps(stamps_s, values)
    assert [(finding.count, finding.sample) for finding in found.findings] == [(1, 1)]
    assert len(found.rows) == COUNT - 1 and not found.sampling.missing.any()


def test_good_stamps_stay_as_they_are() -> None:
    found = ordered(taken())
    assert (found.time_s == taken()).all() and not found.findings
