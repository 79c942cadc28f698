"""Decimal numbers in text, many at a time: their digits summed up column by column, not one string after another. Pure.

So seven numbers take a few tens of nanoseconds each, and a number is exactly what was printed.
"""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

MOST_DIGITS = 18  # that a whole number of 64 bits holds
MOST_DECIMALS = 22  # powers of ten that a float holds exactly
LONGEST = 40  # characters of a number
_ZERO, _POINT, _PLUS, _MINUS = (ord(each) for each in "0.+-")
_POWERS = 10.0 ** np.arange(MOST_DECIMALS + 1)


def numbers_at(text: NDArray[np.uint8], starts: NDArray[np.intp], ends: NDArray[np.intp]) -> Array:
    """The numbers (n,) that stand in `text` from `starts` to before `ends`, NaN for what is none."""
    if not len(starts):
        return np.empty(0)
    whole, digits = _digits(text, starts, ends)
    signs = text[starts]
    signed = (signs == _MINUS) | (signs == _PLUS)
    first, last = int(starts[0]), int(ends[-1])
    points = first + np.flatnonzero(text[first:last] == _POINT)
    belongs = np.searchsorted(starts, points, side="right") - 1
    inside = points < ends[belongs]
    points, belongs = points[inside], belongs[inside]
    pointed = np.bincount(belongs, minlength=len(starts))
    decimals = np.zeros(len(starts), np.int64)
    decimals[belongs] = ends[belongs] - 1 - points
    # Digits, at most one point, and a sign in front are all there is; else it is looked at for itself.
    plain = (pointed <= 1) & (digits + pointed + signed == ends - starts) & (digits > 0) & (digits <= MOST_DIGITS)
    found = whole / _POWERS[np.minimum(decimals, MOST_DECIMALS)]
    found = np.where(signs == _MINUS, -found, found)
    for odd in np.flatnonzero(~plain):
        found[odd] = np.nan
        if ends[odd] - starts[odd] <= LONGEST:
            with suppress(ValueError):
                found[odd] = float(text[starts[odd] : ends[odd]].tobytes())
    found[np.isinf(found)] = np.nan
    return found


def _digits(
    text: NDArray[np.uint8], starts: NDArray[np.intp], ends: NDArray[np.intp]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """What all digits of each number are, read without its point, and how many there are."""
    lengths = ends - starts
    longest = min(int(lengths.max()), MOST_DIGITS + 2)
    values = text - np.uint8(_ZERO)  # what is no digit wraps around to more than nine
    whole, digits = np.zeros(len(starts), np.int64), np.zeros(len(starts), np.int64)
    shortest = int(lengths.min())
    last = len(text) - 1
    for place in range(longest):
        digit = values[np.minimum(starts + place, last)] if place >= shortest else values[starts + place]
        is_digit = digit < 10
        if place >= shortest:
            is_digit &= place < lengths
        whole = np.where(is_digit, whole * 10 + digit, whole)
        digits += is_digit
    return whole, digits
