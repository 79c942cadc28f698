"""What chance says of undamaged recordings: uniform where it is χ², and beyond a limit no more often than is meant."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import cycle

import pytest

from rig.analysis.check import fitness
from support.recordings.checked_runs import checks_of, kind_of, list_failed, probability, solve_inputs
from support.recordings.drawn_recording import KINDS, Kind, drawn
from support.recordings.synthetic_run import Setup

CHI_SQUARE = ("scale_changed", "loose_mounting", "cw_against_ccw", "residuals", "sweeps_against_rests")
# Between sweeps about other axes only the transfers show a change of scale or mounting, and their stated variance is a
# bound: it contains a ripple faster than the states, whether there is one or not.
BOUNDED = ("scale_changed", "loose_mounting")
MOST_OF_MANY = ("axis_changed", "disturbed_sweep", "bias_jumped", "skewed_noise")
LARGER = 0.05  # rate of false alarms of each: so that there are some
REFUSED = 0.01
PROCEDURES = {
    "six axes": Setup(procedure=(("axes", "6"),)),
    "two speeds": Setup(procedure=(("speeds_deg_s", "[40, 90]"),)),
    "twice": Setup(repeats=2),
}


@dataclass
class Seen:
    """Of recordings: p-values by check, how often each was beyond its larger limit, and what failed a run."""

    recordings: int = 0
    p_values: dict[str, list[float]] = field(default_factory=dict)
    beyond: Counter[str] = field(default_factory=Counter)
    alarms: list[tuple[int, set[str]]] = field(default_factory=list)


def seen(seeds: Iterable[int], kinds: Iterable[Kind], setup: Setup | None = None) -> Seen:
    """One recording for every seed, of one kind after the other: two of a seed would have their arm in common."""
    found = Seen()
    for seed, kind in zip(seeds, cycle(kinds), strict=False):
        look = solve_inputs(drawn(seed, kind, setup).run)
        checks = checks_of(look, LARGER)
        found.recordings += 1
        found.beyond.update(list_failed(checks))
        for check in checks:
            if kind_of(check) in CHI_SQUARE:
                found.p_values.setdefault(kind_of(check), []).append(probability(check, LARGER))
        if alarms := list_failed(checks) and list_failed(checks_of(look)):  # limits of a smaller rate are farther out
            found.alarms.append((seed, alarms))
    return found


def held_to_be_uniform(found: Seen, of: str) -> None:
    """Refused once in a hundred is a true uniform distribution, and a true share; p-values of bounds may be larger."""
    from scipy.stats import binom, kstest

    chances = {
        name: float(kstest(p_values, "uniform", alternative="greater" if name in BOUNDED else "two-sided").pvalue)
        for name, p_values in found.p_values.items()
    }
    most = float(binom.ppf(1 - REFUSED, found.recordings, LARGER))
    often = {name: found.beyond[name] for name in MOST_OF_MANY}
    print(f"{of}: { ({name: round(chance, 3) for name, chance in chances.items()}) }")
    print(f"{of}: beyond the limit of one in twenty, at most {most:.0f} of {found.recordings}: {often}")
    assert chances and all(chance > REFUSED for chance in chances.values()), (of, chances)
    assert all(each <= most for each in often.values()), (of, often)


@pytest.mark.thorough
@pytest.mark.one_in(5)
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", KINDS)
def test_what_chance_says_of_undamaged_recordings_is_uniform(kind: str, thorough: bool) -> None:
    """Kolmogorov and Smirnov do not refuse it at 1 %, for each check and part."""
    found = seen(range(200 if thorough else 2), [KINDS[kind]])
    held_to_be_uniform(found, kind)
    assert thorough or not found.alarms


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("procedure", PROCEDURES)
def test_it_is_so_of_every_procedure(procedure: str) -> None:
    """All kinds together: sixty recordings."""
    held_to_be_uniform(seen(range(1000, 1060), KINDS.values(), PROCEDURES[procedure]), procedure)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(7200)
def test_of_a_thousand_undamaged_recordings_two_fail_at_most() -> None:
    """0.2 % of runs; the checks are set for half of that."""
    found = seen(range(2000, 3000), KINDS.values())
    print(f"{found.recordings} recordings, failed: {found.alarms}")
    assert found.recordings >= 1000 and len(found.alarms) <= 2


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("seed", [2179, 2599, 2859])  # one fast vibration, one so slow; two of nearly one frequency
def test_what_shakes_a_quiet_gyroscope_beside_its_encoders_contradicts_nothing(seed: int) -> None:
    assert not seen([seed], [KINDS["KVH 1775"]]).alarms


def test_a_p_value_is_what_the_limit_is_set_by() -> None:
    from scipy.special import chdtri

    for dof in (1, 3, 9, 90):
        limit = float(chdtri(dof, LARGER))
        assert probability(fitness("gyro", "rate", "residuals", limit, limit), LARGER) == pytest.approx(LARGER)
