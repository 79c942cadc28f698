"""The page of public names is what the code says, and every key has a meaning of its own."""

from rig.data.key_meanings import meanings
from support.names_page import PAGE, entries, page_text


def test_the_page_is_today_s() -> None:
    again = "again: PYTHONPATH=tests python -m support.names_page > docs/names.md"
    assert PAGE.read_text(encoding="utf-8") == page_text(), again


def test_no_meaning_is_of_a_key_that_there_is_not() -> None:
    keys = {name for _, entry, of in entries() for key in of for name in (key, f"{entry}.{key}")}
    assert not meanings().keys() - keys


def test_keys_are_the_field_s_words() -> None:
    """What a reader of inertial calibration would have to learn first is no key."""
    private = {"told_from", "held", "anew", "pull", "widened", "sensors", "beside", "found", "refused", "by", "share"}
    private |= {"sizes", "turned", "followed", "laid_down", "held_out", "off_by_expanded", "freedom"}
    keys = [(entry, key.replace("degrees_of_freedom", "dof")) for _, entry, of in entries() for key in of]
    assert not [(entry, key) for entry, key in keys if key in private or key.endswith("_freedom")]


def test_every_option_and_name_has_a_meaning() -> None:
    rows = [line for line in page_text().splitlines() if line.startswith("|")]
    assert not [row for row in rows if not row.removesuffix("|").rpartition("|")[2].strip()]
