"""Whether two results agree within what they state of themselves."""

import math


def normalised_error(first: float, second: float, first_expanded: float, second_expanded: float) -> float:
    """E_n = |y₂ − y₁| / √(U₁² + U₂²), of expanded uncertainties (ISO 13528:2022, 9.7); above 1 they do not agree."""
    return abs(second - first) / math.hypot(first_expanded, second_expanded)
