"""Names of sensors and tables where a program takes letters, digits and underscores alone."""

from collections.abc import Iterable


def plain_names(names: Iterable[str]) -> dict[str, str]:
    """Plain names by name: each begins with a letter and stands once."""
    found: dict[str, str] = {}
    for name in names:
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        if not plain[0].isalpha():
            plain = f"s_{plain}"
        while plain in found.values():  # two names that differ in what is not taken
            plain += "_"
        found[name] = plain
    return found
