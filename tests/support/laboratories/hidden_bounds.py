"""What is asked of errors over their u, and what so many of them can say of it."""

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
        """Return whether both are within their bounds."""
        return self.rms[0] <= rms <= self.rms[1] and self.within[0] <= within <= self.within[1]


def require(values: int) -> Asked:
    """Of fewer than enough values no more than that they do not refuse what is asked, in one test of a hundred.

    As if a world told one value: χ² with a degree of freedom for each world for the RMS, a binomial count of worlds for
    the share. Where its axes have little in common that is wider than it need be. Twenty worlds bound an RMS to 0.52
    and 1.63, and a share to 75 %; what is meant to be 95 % they do not tell from 100.
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
