"""Building blocks of PTB's digital certificate: elements of DCC 3.2.1 and of D-SI 2.1."""

from collections.abc import Iterable, Sequence
from datetime import date
from xml.etree.ElementTree import Element, register_namespace

from rig.errors.quoting import printable
from rig.estimation.statistics.coverage import ELLIPSOID_PROBABILITY
from rig.report.words.expanded_uncertainty import Expanded

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
XSI = "http://www.w3.org/2001/XMLSchema-instance"
DIGITS = 4  # decimals of a probability
NOT_STATED = "not stated"
for _prefix, _name in (("dcc", DCC), ("si", SI), ("xsi", XSI)):
    register_namespace(_prefix, _name)

Part = Element | None


def dcc(name: str, *parts: Part, **attributes: str) -> Element:
    """Return the element `name` of the DCC schema with its parts; parts that are None are left out."""
    return _extend(Element(f"{{{DCC}}}{name}", attributes), parts)


def si(name: str, *parts: Part) -> Element:
    """Return the element `name` of the D-SI schema with its parts; parts that are None are left out."""
    return _extend(Element(f"{{{SI}}}{name}"), parts)


def _extend(element: Element, parts: Iterable[Part]) -> Element:
    element.extend([part for part in parts if part is not None])
    return element


def words(name: str, text: str | date | None) -> Element:
    """Return an element with a text; an unknown text reads "not stated"."""
    element = dcc(name)
    element.text = _printable(text)
    return element


def text(name: str, statement: str | None) -> Element:
    """Return an element with a text that the schema requires to have a language."""
    content = dcc("content", lang="en")
    content.text = _printable(statement)
    return dcc(name, content)


def _printable(statement: str | date | None) -> str:
    """Return text without control characters, which XML does not allow, and one space for any white space."""
    return NOT_STATED if statement is None else printable(" ".join(str(statement).split())) or NOT_STATED


def values(name: str, numbers: Iterable[object]) -> Element:
    """Return an element whose text is a list of numbers or units; floating-point numbers have all their digits."""
    element = si(name)
    element.text = " ".join(str(number) for number in numbers)
    return element


def real(value: float, unit: str) -> Element:
    """Return the element of one value without an uncertainty."""
    return si("real", values("value", [value]), values("unit", [unit]))


def real_list(
    labels: Sequence[str],
    numbers: Sequence[float],
    units: Sequence[str],
    *,
    expanded: Expanded | None = None,
    region: tuple[Sequence[Sequence[float]], float] | None = None,
) -> Element:
    """Return an element of a list of values, with `expanded` uncertainties or the covariance of a joint `region`.

    `region` is the covariance matrix and the region's coverage factor. A single unit applies to all values.
    """
    uncertainty = covered = None
    if expanded is not None:
        uncertainty = si(
            "expandedUncXMLList",
            values("uncertaintyXMLList", expanded.widths),
            values("coverageFactorXMLList", _merge_equal(expanded.factors)),
            values(
                "coverageProbabilityXMLList",
                _merge_equal([round(p, DIGITS) for p in expanded.probabilities]),
            ),
        )
    if region is not None:
        covariance, factor = region
        covered = si(
            "ellipsoidalRegionXMLList",
            _covariance(covariance, units if len(units) > 1 else [*units] * len(covariance)),
            values("coverageFactor", [factor]),
            values("coverageProbability", [ELLIPSOID_PROBABILITY]),
        )
    return si(
        "realListXMLList",
        values("labelXMLList", labels),
        values("valueXMLList", numbers),
        values("unitXMLList", units),
        uncertainty,
        covered,
    )


def _merge_equal(numbers: Sequence[float]) -> Sequence[float]:
    """Return one number if all are equal, else all of them."""
    return numbers[:1] if len(set(numbers)) == 1 else numbers


def _covariance(matrix: Sequence[Sequence[float]], units: Sequence[str]) -> Element:
    columns = [
        si("column", *(si("covariance", values("value", [row[j]]), values("unit", [product(units[i], units[j])]))
                       for i, row in enumerate(matrix)))
        for j in range(len(matrix))
    ]  # fmt: skip
    return si("covarianceMatrix", *columns)


def product(first: str, second: str) -> str:
    """Return the product of two units in D-SI notation; one of them may be `\\one`."""
    if r"\one" in (first, second):
        return second if first == r"\one" else first
    if first != second:
        return first + second
    parts: list[tuple[str, int]] = []
    for name in first.split("\\")[1:]:
        if name.startswith("tothe{"):
            parts[-1] = (parts[-1][0], int(name[6:-1]))
        else:
            parts.append((name, 1))
    return "".join(rf"\{name}\tothe{{{2 * power}}}" for name, power in parts)
