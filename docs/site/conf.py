"""Build the documentation as a site: `make docs` writes it to build/docs, and takes no broken link.

The source folder is the repository: a page may link to whatever lies in it, as where the repository is read.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))  # the procedures and the rig as they are here, installed or not

import rig  # noqa: E402

project = "Calibration rig"
version = release = rig.__version__
html_title = f"{project} {release}"

root_doc = "docs/README"
include_patterns = ["*.md", "docs/**", "firmware_host/**/README.md"]
exclude_patterns = [".venv", "build", "runs", "docs/site"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx_copybutton"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 1800  # s of a cell: for a hang only, however slow the computer is
nb_execution_raise_on_error = True

autodoc_member_order = "bysource"
default_role = "code"

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["cards.css"]
html_js_files = [("labels.js", {"defer": "defer"})]
html_search_scorer = str(ROOT / "docs" / "site" / "static" / "scorer.js")
html_extra_path = [
    "index.html",
    "../config.schema.json",
]  # a way to the first page; editors fetch the schema
html_show_sourcelink = html_show_copyright = False

SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
PAGE = re.compile(r"\]\(([^)#:]+)\.(?:md|rst|ipynb)\)")
LINK = re.compile(r"\[([^\]]+)\]\(([^)#:\s]+)\)")


def without_folders(app: Sphinx, name: str, source: list[str]) -> None:
    """A link to a folder leads somewhere in a repository but not on a site: there its text stands alone."""
    here = (ROOT / name).parent
    source[0] = LINK.sub(lambda link: link[1] if (here / link[2]).is_dir() else link[0], source[0])


def with_contents(app: Sphinx, name: str, source: list[str]) -> None:
    """The first page's links, section by section, are the site's contents, as those to decisions are theirs."""
    if name == "docs/decisions/README":
        pages = "\n".join(PAGE.findall(source[0]))
        source[0] += f"\n\n```{{toctree}}\n:hidden:\n\n{pages}\n```\n"
    if name == root_doc:
        heads = SECTION.split(source[0])[1:]
        for caption, links in zip(heads[::2], heads[1::2], strict=True):
            pages = "\n".join(dict.fromkeys(PAGE.findall(links)))
            source[0] += f"\n\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{pages}\n```\n"


ENTRIES = {"docs/errors": "error", "docs/checks": "check", "docs/configuration": "key", "docs/commands": "command"}


def add_entries(app: Sphinx, document: nodes.document) -> None:
    """Give each error, check, key and command an anchor, and an entry of its own in the search and the index."""
    kind = ENTRIES.get(app.env.docname)
    entries: dict[str, nodes.Element] = {}
    for name, node in _entries(document, kind) if kind else ():
        entries.setdefault(name, node)  # a key of several procedures has the entry of the first
    for name, node in entries.items():
        anchor = nodes.make_id(f"{kind} {name}")
        node["ids"].append(anchor)
        app.env.domains.standard_domain.note_object(kind, name, anchor, location=node)
        index = addnodes.index(entries=[("single", name, anchor, "", None)])
        node.insert(0, index)


def _entries(document: nodes.document, kind: str) -> Iterator[tuple[str, nodes.Element]]:
    """Yield names and their places: sections of commands, else the first cells of the tables' rows."""
    if kind == "command":
        for section in document.findall(nodes.section):
            title = section.next_node(nodes.title).astext()
            if title.startswith("rig "):
                yield title, section
        return
    for row in document.findall(nodes.row):
        if not isinstance(row.parent, nodes.tbody) or not (names := list(row[0].findall(nodes.literal))):
            continue
        section = row
        while not isinstance(section, nodes.section):
            section = section.parent
        heading = section.next_node(nodes.title)
        path = f"{(heading.next_node(nodes.literal) or heading).astext()}." if kind == "key" else ""
        for name in names:
            yield path + name.astext(), row[0]


def setup(app: Sphinx) -> None:
    for kind in ENTRIES.values():
        app.add_object_type(kind, f"rig-{kind}", objname=kind)
    app.connect("doctree-read", add_entries)
    app.connect("source-read", without_folders)
    app.connect("source-read", with_contents)
