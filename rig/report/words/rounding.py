"""How a value and its uncertainty are written (JCGM 100, 7.2.6; EA-4/02 M:2022, 6.3)."""

from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Context, Decimal

DIGITS = 2  # significant, of an uncertainty
NO_U = "–"
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
WIDE = Context(prec=1000)  # a value may have any size beside its uncertainty


@dataclass(frozen=True, slots=True)
class Rounded:
    """A value and its expanded uncertainty U, both to the same decimal."""

    value: Decimal
    uncertainty: Decimal

    @property
    def value_text(self) -> str:
        """The value in print, with the minus sign that typesetters use."""
        return f"{self.value:f}".replace("-", "−")

    @property
    def uncertainty_text(self) -> str:
        return f"{self.uncertainty:f}"


def rounded(value: float, uncertainty: float) -> Rounded:
    """U to two significant digits, the value to the same decimal.

    Half is rounded up: so U never falls by more than 4.8 %, and EA-4/02 wants it rounded up only from 5 %. Raises
    ValueError for a value that is not finite or an uncertainty that is not a positive number.
    """
    exact, wide = Decimal(repr(value)), Decimal(repr(uncertainty))
    if not exact.is_finite() or not wide.is_finite() or wide <= 0:
        raise ValueError(f"{value!r} ± {uncertainty!r} cannot be rounded")
    last = wide.adjusted() - (DIGITS - 1)
    if _to(wide, last).adjusted() > wide.adjusted():  # 0.0996 is 0.10
        last += 1
    return Rounded(_to(exact, last), _to(wide, last))


def in_print(value: float, uncertainty: float) -> tuple[str, str]:
    """The texts of a value and its U; six digits and a dash where there is no U that is a positive number."""
    try:
        found = rounded(float(value), float(uncertainty))
    except ValueError:
        return f"{value:.6g}".replace("-", "−"), NO_U
    return found.value_text, found.uncertainty_text


def plus_minus(value: float, uncertainty: float) -> str:
    """A value ± U in print, the value alone where there is no U."""
    said, known = in_print(value, uncertainty)
    return said if known == NO_U else f"{said} ± {known}"


def small(value: float) -> str:
    """Two digits, in powers of ten."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}\u00a0×\u00a0{power_of_ten(int(exponent))}"


def figures(value: float) -> str:
    """Three digits at most, and a power of ten where it is far from one."""
    mantissa, _, exponent = f"{value:.3g}".partition("e")
    return f"{mantissa}\u00a0×\u00a0{power_of_ten(int(exponent))}" if exponent else mantissa


def power_of_ten(exponent: int) -> str:
    """10 with its exponent raised."""
    return f"10{str(exponent).translate(RAISED)}"


def percent(share: float) -> str:
    """A share of the variance, in percent."""
    return "<\u00a00.1\u00a0%" if share < 0.001 else f"{100 * share:.1f}\u00a0%"


def _to(number: Decimal, exponent: int) -> Decimal:
    found = number.quantize(Decimal((0, (1,), exponent)), ROUND_HALF_UP, WIDE)
    return found if found else abs(found)  # no −0.000
