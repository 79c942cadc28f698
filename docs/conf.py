"""Build the documentation as a site: `make docs` writes it to build/docs, and takes no broken link.

The source folder is the repository: a page may link to whatever lies in it, as where the repository is read.
"""

import re
import sys
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[1]
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
nb_execution_timeout = 120
nb_execution_raise_on_error = True

autodoc_member_order = "bysource"
default_role = "code"

html_theme = "furo"
html_extra_path = ["site", "config.schema.json"]  # site/index.html leads to the first page; editors fetch the schema
html_show_sourcelink = False

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


def setup(app: Sphinx) -> None:
    app.connect("source-read", without_folders)
    app.connect("source-read", with_contents)
