"""What the program needs, as the installed packages themselves say: names, licences."""

from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ITSELF = "calibration-rig"


def list_needed(extras: Iterable[str]) -> dict[str, Distribution]:
    """Every package that an installation with these extras brings, by its name, without the program itself."""
    found: dict[str, Distribution] = {}
    asked: set[tuple[str, str]] = set()
    to_ask = [(ITSELF, extra) for extra in ("", *extras)]
    while to_ask:
        name, extra = to_ask.pop()
        if (name, extra) in asked:
            continue
        asked.add((name, extra))
        try:
            found[name] = distribution(name)
        except PackageNotFoundError:
            continue  # of another system's, or of an extra that is not installed
        to_ask += _list_required(found[name], extra)
    del found[ITSELF]
    return found


def _list_required(package: Distribution, extra: str) -> Iterator[tuple[str, str]]:
    for line in package.requires or ():
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
            for each in ("", *requirement.extras):
                yield canonicalize_name(requirement.name), each


def licence(package: Distribution) -> str:
    """What it says of its licence: an SPDX expression, else classifiers, else the first line of its text; may be ""."""
    told = package.metadata
    if "License-Expression" in told:
        return str(told["License-Expression"])
    classifiers = [
        line.rsplit(" :: ")[-1]
        for line in told.get_all("Classifier") or ()
        if line.startswith("License :: ") and line != "License :: OSI Approved"
    ]
    text = str(told["License"]).strip() if "License" in told else ""
    return " / ".join(sorted(classifiers)) or text.split("\n", maxsplit=1)[0]
