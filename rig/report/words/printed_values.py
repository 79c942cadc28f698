"""A value and its uncertainty in print (JCGM 100, 7.2.6; EA-4/02 M:2022, 6.3)."""

from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Context, Decimal

U_DIGITS = 2  # significant digits of an uncertainty
NO_U = "–"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
WIDE_CONTEXT = Context(prec=1000)  # a value may be much larger than its uncertainty


@dataclass(frozen=True, slots=True)
class RoundedValue:
    """A value and its expanded uncertainty U, both to the same decimal."""

    value: Decimal
    uncertainty: Decimal

    @property
    def value_text(self) -> str:
        """The printed value, with a typographic minus sign."""
        return f"{self.value:f}".replace("-", "−")

    @property
    def uncertainty_text(self) -> str:
        return f"{self.uncertainty:f}"


def round_to_u(value: float, uncertainty: float) -> RoundedValue:
    """Return U to two significant digits, and the value to the same decimal.

    Halves are rounded up, so U never decreases by more than 4.8 %; EA-4/02 requires rounding up only from 5 %. Raise
    ValueError if the value is not finite or the uncertainty is not a positive number.
    """
    exact, wide = Decimal(repr(value)), Decimal(repr(uncertainty))
    if not exact.is_finite() or not wide.is_finite() or wide <= 0:
        raise ValueError(f"{value!r} ± {uncertainty!r} cannot be rounded")
    last = wide.adjusted() - (U_DIGITS - 1)
    if _quantize(wide, last).adjusted() > wide.adjusted():  # 0.0996 is 0.10
        last += 1
    return RoundedValue(_quantize(exact, last), _quantize(wide, last))


def format_signed(value: float, decimals: int) -> str:
    """Return a value with its sign, a typographic minus if negative, and `decimals` digits behind the point."""
    return f"{value:+.{decimals}f}".replace("-", "−")


def format_with_u(value: float, uncertainty: float) -> tuple[str, str]:
    """Return a value and its U as texts; without a positive U the value has six digits, and a dash replaces U."""
    try:
        printed = round_to_u(float(value), float(uncertainty))
    except ValueError:
        return f"{value:.6g}".replace("-", "−"), NO_U
    return printed.value_text, printed.uncertainty_text


def plus_minus(value: float, uncertainty: float) -> str:
    """Return a printed value ± U, or the value alone if U is not positive."""
    text, width = format_with_u(value, uncertainty)
    return text if width == NO_U else f"{text} ± {width}"


def small(value: float) -> str:
    """Return a small number as two digits and a power of ten."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}\u00a0×\u00a0{power_of_ten(int(exponent))}"


def figures(value: float) -> str:
    """Return a number with at most three digits, and a power of ten if it is very large or small."""
    mantissa, _, exponent = f"{value:.3g}".partition("e")
    return f"{mantissa}\u00a0×\u00a0{power_of_ten(int(exponent))}" if exponent else mantissa


def power_of_ten(exponent: int) -> str:
    """Return 10 with a superscript exponent."""
    return f"10{str(exponent).translate(SUPERSCRIPTS)}"


def percent(fraction: float) -> str:
    """Return a fraction of the variance as a percentage."""
    return "<\u00a00.1\u00a0%" if fraction < 0.001 else f"{100 * fraction:.1f}\u00a0%"


def _quantize(number: Decimal, exponent: int) -> Decimal:
    quantized = number.quantize(Decimal((0, (1,), exponent)), ROUND_HALF_UP, WIDE_CONTEXT)
    return quantized if quantized else abs(quantized)  # no −0.000
