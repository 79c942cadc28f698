"""`rig explain`: the meaning of a check, an error, a limit or a word, and where to read more."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused
from rig.errors.quoting import shorten
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.errors.remedies_by_method import CalibrationMethod

METHODS: "dict[CalibrationMethod, str]" = {
    "hand": "by hand",
    "file": "with readings from files",
    "arm": "on an arm or a servomotor",
}


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig explain`."""
    what = "a check (gyro.scale_changed), an error (wrong_axis), a limit, or a word (E_n, sweep, scale factor)"
    action = parser.add_argument("name", nargs="+", metavar="NAME", help=what)
    action.completer = lambda **_: _list_names()  # pyrefly: ignore[missing-attribute]  # as argcomplete asks for it


def run(options: Namespace) -> int:
    """Print the meaning of the option `name` and return 0. Raise Refused `nothing_known`."""
    name = " ".join(options.name).strip()
    lines = [*_explain_check(name), *_explain_limit(name), *_explain_error(name), *_explain_word(name)]
    if not lines:
        names = {*_list_names()}
        containing = sorted(word for word in names if name.casefold() in word.casefold().split())
        alike = containing or get_close_matches(name, names, cutoff=0.5)
        remedy = f"Did you mean {' or '.join(alike)}?" if alike else "Give the name exactly as it was printed"
        raise Refused("nothing_known", f"there is no check, error, limit or word called {shorten(name)}", remedy)
    for line in lines:
        say(line)
    return 0


def _explain_check(name: str) -> Iterator[str]:
    from rig.report.words.check_words import words_of_name

    if (words := words_of_name(name)) is not None:
        yield f"{words.name}: a check of the verdict. It fails when {words.means}."
        yield f"What to do: {words.remedy.replace('`', '').rstrip('.')}."
        yield from _refer_to("docs/checks.md", "docs/method.md")


def _explain_limit(name: str) -> Iterator[str]:
    """Yield meaning and unit of a limit of the configuration, by its key or its check; nothing for another name."""
    from rig.config.judging.verdict_limits import LIMITS, Limits
    from rig.report.words.check_words import words_of_name

    key_name, check = name.removeprefix("limits."), words_of_name(name)
    rows = {
        key: row for key, row in LIMITS.items() if key == key_name or (check is not None and check.name == row.what)
    }
    for key, row in rows.items():
        kind = "a property of the sensor" if row.kind == "conformity" else "how good the measurement is"
        unit = "" if row.unit == "1" else f", in {row.unit}"
        yield f"limits.{key}: a limit on {kind}: {Limits.model_fields[key].description}{unit}."
    if rows:
        yield from _refer_to("docs/configuration.md")


def _explain_error(name: str) -> Iterator[str]:
    from rig.errors.catalogue import catalogue

    for entry in catalogue():
        if entry.name == name:
            yield f"{entry.name}: an error. It occurs when {entry.when}."
            yield from _explain_remedies(name, entry.remedy)
            yield from _refer_to("docs/errors.md")


def _explain_remedies(name: str, usual: str) -> Iterator[str]:
    """Yield the `usual` remedy of an error, or one for each method of calibration, the latest run's method first."""
    from rig.errors.remedies_by_method import remedies_by_method

    remedies = remedies_by_method(name)
    if not remedies:
        yield f"What to do: {usual.rstrip('.')}."
        return
    used = _find_method_in_use()
    for method in sorted(remedies, key=lambda method: method != used):
        as_now = ", as in your latest run" if method == used else ""
        yield f"What to do {METHODS[method]}{as_now}: {remedies[method].rstrip('.')}."


def _find_method_in_use() -> "CalibrationMethod | None":
    """Return the latest run's method of calibration, from its configuration; None if it is unknown."""
    import yaml

    from rig.config.files.regular_file import UnfitFile, read_regular_file
    from rig.data.latest_run import latest_run
    from rig.data.run_folder import CONFIG

    try:
        folder: Path = latest_run()
        if not (folder / CONFIG).exists():
            return "file"
        document = yaml.safe_load(read_regular_file(folder / CONFIG, 1_000_000, follow_links=False))
    except (Refused, OSError, UnfitFile, yaml.YAMLError):
        return None
    turner = document.get("turner") if isinstance(document, dict) else None
    return "hand" if isinstance(turner, dict) and turner.get("kind") == "hand" else "arm"


def _explain_word(name: str) -> Iterator[str]:
    from rig.report.words.glossary import find_words

    words = [*find_words(name)]
    for word in words:
        yield f"{word.names}: {word.plain_meaning(with_pages=_has_pages('docs/glossary.md'))}"
    if words:
        yield from _refer_to("docs/glossary.md")


def _list_names() -> list[str]:
    from rig.config.judging.verdict_limits import LIMITS
    from rig.errors.catalogue import catalogue
    from rig.report.words.check_words import check_words
    from rig.report.words.glossary import glossary

    words = (name for word in glossary() for name in word.synonyms)
    return [*check_words(), *LIMITS, *(entry.name for entry in catalogue()), *words]


def _has_pages(*pages: str) -> bool:
    """Return whether the program was installed with its pages."""
    from rig.config.files.supplied_files import locate_supplied

    return all(locate_supplied(page).exists() for page in pages)


def _refer_to(*pages: str) -> Iterator[str]:
    """Yield the line that names further pages, unless the program was installed without them."""
    if _has_pages(*pages):
        yield f"More: {', '.join(pages)}"
