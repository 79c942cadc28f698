"""The program's dependencies by the installed packages' metadata: names, licences."""

from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ITSELF = "calibration-rig"


def list_needed(extras: Iterable[str]) -> dict[str, Distribution]:
    """Return by name every package that an installation with these extras needs, without the program itself."""
    distributions: dict[str, Distribution] = {}
    visited: set[tuple[str, str]] = set()
    to_ask = [(ITSELF, extra) for extra in ("", *extras)]
    while to_ask:
        name, extra = to_ask.pop()
        if (name, extra) in visited:
            continue
        visited.add((name, extra))
        try:
            distributions[name] = distribution(name)
        except PackageNotFoundError:
            continue  # of another system's, or of an extra that is not installed
        to_ask += _list_required(distributions[name], extra)
    del distributions[ITSELF]
    return distributions


def _list_required(package: Distribution, extra: str) -> Iterator[tuple[str, str]]:
    for line in package.requires or ():
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
            for extra_name in ("", *requirement.extras):
                yield canonicalize_name(requirement.name), extra_name


def licence(package: Distribution) -> str:
    """Return a package's licence: SPDX expression, else classifiers, else the first line of its text; may be ""."""
    metadata = package.metadata
    if "License-Expression" in metadata:
        return str(metadata["License-Expression"])
    classifiers = [
        line.rsplit(" :: ")[-1]
        for line in metadata.get_all("Classifier") or ()
        if line.startswith("License :: ") and line != "License :: OSI Approved"
    ]
    text = str(metadata["License"]).strip() if "License" in metadata else ""
    return " / ".join(sorted(classifiers)) or text.split("\n", maxsplit=1)[0]
