"""CITATION.cff is what CFF 1.2.0 asks for, and says the version and licence that the package says."""

import re
from typing import Any

import yaml

import rig
from support.paths import DOCS, ROOT

REQUIRED = {
    "cff-version",
    "message",
    "title",
    "authors",
}  # CFF 1.2.0, of the file; of a reference: type, title, authors
KNOWN = REQUIRED | {"abstract", "keywords", "license", "references", "type", "version"}


def citation() -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    return document


def test_the_file_holds_what_the_format_asks_for() -> None:
    document = citation()
    assert set(document) >= REQUIRED and set(document) <= KNOWN
    assert document["cff-version"] == "1.2.0" and document["type"] == "software"
    for reference in document["references"]:
        assert {"type", "title", "authors"} <= set(reference)
    for author in [*document["authors"], *(author for r in document["references"] for author in r["authors"])]:
        assert set(author) in ({"name"}, {"family-names", "given-names"})


def test_version_licence_and_authors_are_the_package_s() -> None:
    document = citation()
    assert document["version"] == rig.__version__
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert licence.startswith(f"{document['license']} License")
    assert re.search(re.escape(document["authors"][0]["name"]), licence)


def test_every_doi_and_title_of_the_citation_stands_on_the_page() -> None:
    page = " ".join((DOCS / "references.md").read_text(encoding="utf-8").split())
    for reference in citation()["references"]:
        assert reference["title"] in page
        assert reference.get("doi", "") in page
