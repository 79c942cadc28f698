"""The requirements on errors over their u, and the power of a number of worlds to test them."""

from dataclasses import dataclass

RMS = 0.85, 1.15  # of error over u
WITHIN = 0.92, 0.98  # of the values, within U
ENOUGH = 180  # values, of 60 worlds: an RMS strays by 0.05 where each is for itself, by 0.09 where each world is
AXES = 3  # of a run share an arm and a clock
CHANCE = 0.005  # either way


@dataclass(frozen=True, slots=True)
class Asked:
    """Bounds of the RMS of error over u, and of the fraction within U."""

    rms: tuple[float, float]
    within: tuple[float, float]

    def kept(self, rms: float, within: float) -> bool:
        """Return whether RMS and fraction are within their bounds."""
        return self.rms[0] <= rms <= self.rms[1] and self.within[0] <= within <= self.within[1]


def require(values: int) -> Asked:
    """Return the bounds for these values; few values get wider bounds, so that one test of a hundred fails by chance.

    Each world is one value: χ² with a degree of freedom per world for the RMS, a binomial count of worlds for the
    fraction. If a world's axes have little in common, this is wider than necessary. With twenty worlds the RMS is
    bounded by 0.52 and 1.63, the fraction by 75 %; they cannot distinguish 95 % from 100 %.
    """
    from scipy.special import chdtri
    from scipy.stats import binom

    if values >= ENOUGH:
        return Asked(RMS, WITHIN)
    worlds = values / AXES
    low, high = (float(chdtri(worlds, share) / worlds) ** 0.5 for share in (1 - CHANCE, CHANCE))
    shares = zip((CHANCE, 1 - CHANCE), WITHIN, strict=True)
    few, many = (float(binom.ppf(chance, round(worlds), share)) / round(worlds) for chance, share in shares)
    return Asked((RMS[0] * low, RMS[1] * high), (few, many))
