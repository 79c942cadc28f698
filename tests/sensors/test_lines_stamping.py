"""Which sample is which, and when: by the device's time, by counting, by arrival."""

from typing import Any

import numpy as np
import pytest

from rig.sensors.errors import SensorError
from rig.sensors.lines.stamping import Stamper
from support.wires.printed_lines import lines_section

FOUR = ("time", "gx", "gy", "gz")


def stamped(values: np.ndarray, rate_hz: float = 100, **section: Any) -> tuple[Stamper, np.ndarray, np.ndarray]:
    """Numbers and times of `values` that come ten at a time."""
    stamper = Stamper(lines_section(acceleration=None, **section), rate_hz, "sensors.imu")
    found = [stamper.stamp(values[at : at + 10], 0, 0.1 * at / 10) for at in range(0, len(values), 10)]
    _, numbers, times_us = (np.concatenate([each[place] for each in found]) for place in (0, 1, 2))
    return stamper, numbers, times_us


def rows(first: np.ndarray) -> np.ndarray:
    return np.column_stack([first, np.zeros((len(first), 3))])


@pytest.mark.parametrize(("unit", "wrap", "size"), [("us", 2.0**32, 1e6), ("us", 2.0**30, 1e6), ("ms", 65536, 1e3)])
def test_the_devices_time_goes_on_across_its_wrap(unit: str, wrap: float, size: float) -> None:
    printed = (wrap - 0.5 * size + size * 0.01 * np.arange(200)) % wrap
    time = {"unit": unit, "wrap": wrap}
    stamper, numbers, times_us = stamped(rows(printed.round()), columns=FOUR, time=time)
    assert numbers.tolist() == list(range(200)) and stamper.lost == 0
    assert np.abs(np.diff(times_us) - 10_000).max() <= 1


def test_lost_samples_are_counted_by_time() -> None:
    printed = np.delete(np.arange(300) * 10_000.0, [40, 41, 42, 199])
    stamper, numbers, _ = stamped(rows(printed), columns=FOUR)
    assert stamper.lost == 4 and numbers[-1] == 299


@pytest.mark.parametrize("wrap", [0, 256, 10])
def test_a_sequence_counts_them_whatever_the_time_does(wrap: int) -> None:
    """Time of a loop that waits is uneven, and 25 lost in a row are more than a wrap of ten tells."""
    rng = np.random.default_rng(2)
    kept = np.delete(np.arange(300), [40, 41, 42, *range(200, 225)])
    printed = kept * 10_000.0 + rng.uniform(-2000, 2000, len(kept))
    counted = kept % wrap if wrap else kept
    values = np.column_stack([printed, counted, np.zeros((len(kept), 3))])
    columns = ("time", "sequence", "gx", "gy", "gz")
    stamper, numbers, _ = stamped(values, columns=columns, sequence_wrap=wrap)
    assert np.array_equal(numbers, kept) and stamper.lost == 28


@pytest.mark.parametrize("damaged", [50, 59, 60])
def test_one_time_too_far_ahead_costs_the_samples_up_to_it_and_no_more(damaged: int) -> None:
    true_us = np.arange(100) * 10_000.0
    printed = true_us.copy()
    printed[damaged] += 200_000
    stamper, numbers, times_us = stamped(rows(printed), columns=FOUR)
    assert numbers[-1] == 99 and len(numbers) == 80 and stamper.lost == 20
    assert times_us[-1] - times_us[0] == true_us[-1]


def test_a_time_that_stands_or_alternates_ends_the_stream() -> None:
    standing, alternating = np.arange(300) * 10_000.0, np.arange(600) * 10_000.0
    standing[100:] = standing[100]
    alternating[100:] = alternating[100]
    alternating[101:] -= 5000
    for printed in (standing, alternating):
        with pytest.raises(SensorError, match="lines_time_jumped"):
            stamped(rows(printed), columns=FOUR)


@pytest.mark.parametrize(
    ("columns", "step", "wrap", "remedy"),
    [
        (FOUR, 10_000, 2**30, "set lines.time.wrap to 1073741824"),
        (("sequence", "gx", "gy", "gz"), 1, 65536, "set lines.sequence_wrap to 65536"),
        (("sequence", "gx", "gy", "gz"), 1, 10_000, "set lines.sequence_wrap to 10000"),
        (FOUR, 10_000, 7 * 10**8, "Check its supply"),
        (FOUR, 10_000, 2**30 - 10**5, "Check its supply"),  # a restart shortly before
    ],
)
def test_a_counter_that_starts_again_where_no_key_says_so_names_the_key(
    columns: tuple[str, ...], step: int, wrap: int, remedy: str
) -> None:
    printed = (wrap - 50 * step + step * np.arange(100)) % wrap
    keys: dict[str, Any] = {"columns": columns} | ({} if columns == FOUR else {"time": None, "clock": "counted"})
    with pytest.raises(SensorError) as caught:
        stamped(rows(printed.astype(float)), **keys)
    assert caught.value.name == "lines_time_jumped" and remedy in str(caught.value)
    assert ("starts again" in str(caught.value)) == remedy.startswith("set")


def test_one_time_that_cannot_be_is_damage_three_are_a_restart() -> None:
    printed = np.arange(100) * 10_000.0 + 5e7
    printed[50] += 9e8
    stamper, numbers, _ = stamped(rows(printed), columns=FOUR)
    assert stamper.odd == 1 and stamper.lost == 1 and len(numbers) == 99
    printed[60:] -= 5e7
    with pytest.raises(SensorError, match="lines_time_jumped"):
        stamped(rows(printed), columns=FOUR)


@pytest.mark.slow
def test_coarse_times_are_made_even_and_never_meet() -> None:
    true_us = np.arange(20_000) * 1000 * (1 + 3e-5) + 300
    stamper, _, times_us = stamped(rows(true_us // 1000), 1000, columns=FOUR, time={"unit": "ms"})
    assert stamper.lost == 0 and (np.diff(times_us) > 0).all()
    off = (times_us - true_us)[5000:]
    assert off.std() < 150, "a millisecond is divided"


def test_by_counting_the_clock_is_the_devices_rate() -> None:
    values = np.column_stack([np.delete(np.arange(500), 77), np.zeros((499, 3))])
    section: dict[str, Any] = {"columns": ("sequence", "gx", "gy", "gz"), "time": None, "clock": "counted"}
    _, numbers, times_us = stamped(values, 100, **section)
    assert np.array_equal(times_us, numbers * 10_000) and numbers[-1] == 499


def test_times_of_arrival_begin_with_the_first_sample() -> None:
    """However long the computer had been running by then."""
    section = lines_section(acceleration=None, time=None, columns=("gx", "gy", "gz"), clock="arrival")
    stamper = Stamper(section, 100.0, "sensors.imu")
    times_us = [stamper.stamp(np.zeros((10, 3)), 0, 1000 + 0.1 * heap)[2] for heap in range(1, 51)]
    np.testing.assert_allclose(np.concatenate(times_us), 10_000 * np.arange(500), atol=1)


@pytest.mark.slow
def test_arrival_times_are_made_even() -> None:
    """Bytes come in heaps, 0 to 16 ms late, as from an adapter that collects."""
    rng = np.random.default_rng(4)
    section = lines_section(acceleration=None, time=None, columns=("gx", "gy", "gz"), clock="arrival")
    stamper = Stamper(section, 200.0, "sensors.imu")
    arrived = np.arange(12_000) / 200 + rng.uniform(0, 0.016, 12_000)
    heaps = np.split(np.arange(12_000), np.sort(rng.choice(12_000, 4000, replace=False)))
    came = [(len(heap), 50.0 + float(arrived[heap].max())) for heap in heaps if len(heap)]
    at = [stamper.stamp(np.zeros((count, 3)), 0, when_s)[2] for count, when_s in came]
    times_s = np.concatenate(at)[2000:] * 1e-6
    line = np.polyfit(np.arange(len(times_s)), times_s, 1)
    assert line[0] == pytest.approx(1 / 200, rel=1e-4)
    assert np.std(times_s - np.polyval(line, np.arange(len(times_s)))) < 0.0015
    assert stamper.lost == 0
