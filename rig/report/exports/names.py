"""Names of sensors and tables for programs that accept letters, digits and underscores only."""

from collections.abc import Iterable


def plain_names(names: Iterable[str]) -> dict[str, str]:
    """Return a unique plain name, beginning with a letter, for each name."""
    plain_by_name: dict[str, str] = {}
    for name in names:
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        if not plain[0].isalpha():
            plain = f"s_{plain}"
        while plain in plain_by_name.values():  # two names that differ in replaced characters
            plain += "_"
        plain_by_name[name] = plain
    return plain_by_name
