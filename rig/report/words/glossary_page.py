"""The page of words, docs/glossary.md: `python -m rig.report.words.glossary_page > docs/glossary.md`."""

from collections.abc import Iterator

from rig.report.words.glossary import glossary

SECTIONS = {
    "field": ("Words of the field", "what it means"),
    "machine": ("Words of the arm, the board and computers", "what it means"),
    "project": ("Words of this project", "what it means here"),
}


def page_text() -> str:
    """Return the glossary as Markdown, in three sections."""
    lines = [
        "# Glossary",
        "",
        "Generated from [`rig/report/words/glossary.txt`](../rig/report/words/glossary.txt) and, for the words of this",
        "project, [`words.toml`](../rig/report/words/words.toml) by `python -m rig.report.words.glossary_page >",
        "docs/glossary.md`: change these tables, not this page.",
        "",
        "Words of the pages, the terminal and the certificate, for people of other fields and for readers whose second",
        "language is English. `rig explain WORD` prints a row of this table.",
    ]
    for owner, (title, heading) in SECTIONS.items():
        lines += ["", f"## {title}", "", f"| word | {heading} |", "| --- | --- |", *_rows(owner)]
    return "\n".join(lines) + "\n"


def _rows(owner: str) -> Iterator[str]:
    for word in glossary():
        if word.owner == owner:
            yield f"| {word.names} | {word.meaning.replace('|', chr(92) + '|')} |"


if __name__ == "__main__":
    print(page_text(), end="")
