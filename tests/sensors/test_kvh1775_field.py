"""Format C's field from messages that come in any pieces, with losses and wraps."""

from itertools import pairwise

import numpy as np
import pytest

from rig.sensors.kvh1775.format_c_field import MagneticFieldReader
from rig.sensors.kvh1775.kvh_messages import MESSAGE_DTYPE, SEQUENCE_NUMBERS

COUNT_T = 1e-9
COUNT, FIRST = 900, 57  # of messages, and the sequence number of the first: seven wraps


def axis_of(number: np.ndarray) -> np.ndarray:
    """Every message another, in counts."""
    return 1000 + number


def read(kept: np.ndarray, cuts: list[int]) -> np.ndarray:
    """The samples of the messages of these numbers, handed on in pieces."""
    messages = np.zeros(COUNT, MESSAGE_DTYPE)
    numbers = np.arange(COUNT)
    messages["sequence"] = (FIRST + numbers) % SEQUENCE_NUMBERS
    messages["fourth"] = axis_of(numbers) * COUNT_T / 1e-4
    reader = MagneticFieldReader(COUNT_T, 1 << 30)
    pieces = [kept[(kept >= a) & (kept < b)] for a, b in pairwise([0, *cuts, COUNT])]
    return np.concatenate([reader.feed(messages[p], p, 4000 * p, 1.0) for p in pieces])


@pytest.mark.parametrize("seed", range(5))
def test_only_whole_readings_are_handed_on_however_they_come(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kept = np.flatnonzero(rng.random(COUNT) > 0.1 * seed)
    found = read(kept, sorted(rng.integers(1, COUNT, 200).tolist()))
    # Sequence numbers 1, 5, 9, … begin a reading, of which all three axes must be there.
    x = np.array([n for n in range(COUNT - 2) if (FIRST + n) % 4 == 1 and np.isin([n, n + 1, n + 2], kept).all()])
    assert found["field_counts"].tolist() == np.column_stack([axis_of(x), axis_of(x + 1), axis_of(x + 2)]).tolist()
    assert found["sequence"].tolist() == ((x - x[0]) // 4).tolist()
    assert found["board_time_us"].tolist() == (4000 * (x + 1)).tolist()


def test_a_number_that_is_none_is_a_reading_lost() -> None:
    messages = np.zeros(8, MESSAGE_DTYPE)
    messages["sequence"], messages["fourth"] = np.arange(8), 0.5
    messages["fourth"][2] = np.nan
    found = MagneticFieldReader(COUNT_T, 1 << 30).feed(messages, np.arange(8), np.arange(8), 0.0)
    assert found["sequence"].tolist() == [0] and found["field_counts"].tolist() == [[50_000] * 3]
