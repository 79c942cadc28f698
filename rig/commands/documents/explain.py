"""`rig explain`: what a check, an error, a limit or a word is, and where to look."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from difflib import get_close_matches

from rig.errors import Refused
from rig.errors.quoting import shorten
from rig.station.plain_text import say


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig explain`."""
    what = "a check (gyro.scale_changed), an error (wrong_axis), a limit, or a word (E_n, sweep, scale factor)"
    parser.add_argument("name", nargs="+", metavar="NAME", help=what)


def run(options: Namespace) -> int:
    """Print what the name means. Returns 0. Raises Refused `nothing_known`."""
    name = " ".join(options.name).strip()
    lines = [*_check(name), *_limit(name), *_error(name), *_word(name)]
    if not lines:
        alike = get_close_matches(name, _names(), cutoff=0.5)
        known = f"Did you mean {' or '.join(alike)}?" if alike else "Give a name as it was printed"
        raise Refused("nothing_known", f"there is no check, error, limit or word called {shorten(name)}", known)
    for line in lines:
        say(line)
    return 0


def _check(name: str) -> Iterator[str]:
    from rig.report.words.check_words import words_of_name

    if (words := words_of_name(name)) is not None:
        yield f"{words.name}: a check of the verdict. It fails when {words.means}."
        yield f"What to do: {words.remedy.replace('`', '')}"
        yield "More: docs/checks.md, docs/method.md"


def _limit(name: str) -> Iterator[str]:
    from rig.config.judging.limits import LIMITS, Limits

    key = name.removeprefix("limits.")
    if key in LIMITS:
        row = LIMITS[key]
        of = "a property of the sensor" if row.kind == "conformity" else "how good the measurement is"
        unit = "" if row.unit == "1" else f", in {row.unit}"
        yield f"limits.{key}: a limit on {of}: {Limits.model_fields[key].description}{unit}."
        yield "More: docs/configuration.md"


def _error(name: str) -> Iterator[str]:
    from rig.errors.catalogue import catalogue

    for entry in catalogue():
        if entry.name == name:
            yield f"{entry.name}: an error. It occurs when {entry.when}."
            yield f"What to do: {entry.remedy}."
            yield "More: docs/errors.md"


def _word(name: str) -> Iterator[str]:
    from rig.report.words.glossary import find_words

    found = [*find_words(name)]
    for word in found:
        yield f"{word.names}: {word.plain_meaning}"
    if found:
        yield "More: docs/glossary.md"


def _names() -> list[str]:
    from rig.config.judging.limits import LIMITS
    from rig.errors.catalogue import catalogue
    from rig.report.words.check_words import check_words
    from rig.report.words.glossary import glossary

    words = (name for word in glossary() for name in word.synonyms)
    return [*check_words(), *LIMITS, *(entry.name for entry in catalogue()), *words]
