"""The code has the words of rig/report/words/words.toml, and names and docstrings as CONTRIBUTING.md asks."""

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
WORDS = tomllib.loads((REPOSITORY / "rig/report/words/words.toml").read_text("utf-8"))
NEVER_BOUND = frozenset(WORDS["never_bound"])
# Keys of configuration and column files, which are named by their readers.
PUBLIC_KEYS = {("HistorySection", "off"), ("SiteSection", "place"), ("AxisSection", "along")}
# Class names that several files still share. A name leaves this list when it does no more; none is added.
SHARED_NAMES = {
    "Candidate",
    "Equations",
    "Fit",
    "Fits",
    "Item",
    "Mean",
    "Observation",
    "Read",
    "Recorded",
    "Rest",
    "RobotMode",
    "Run",
    "RuntimeState",
    "SafetyMode",
    "Samples",
    "SimulatedOperator",
    "State",
    "Steps",
}
RELATIVE_CLAUSE = re.compile(
    r"(\([^)]*\)[,:]? ?)?(what|whether|how|where|who|whom|which|when|why|that)\b", re.IGNORECASE
)
DOCUMENTED = ast.FunctionDef | ast.AsyncFunctionDef

Room = tuple[str, list[tuple[str, ast.Module]]]


def test_a_name_says_what_it_is_bound_to() -> None:
    assert [
        f"{file}:{node.lineno}: {name}"
        for file, tree in modules()
        for node, name, owner in bindings(tree)
        if name.strip("_").lower() in NEVER_BOUND and (owner, name) not in PUBLIC_KEYS
    ] == []


def test_no_docstring_of_a_function_opens_with_a_relative_clause() -> None:
    """PEP 257: a verb first."""
    assert [
        f"{file}:{node.lineno}: {text.splitlines()[0]}"
        for file, tree in modules()
        for node in ast.walk(tree)
        if isinstance(node, DOCUMENTED) and not is_property(node)
        if (text := ast.get_docstring(node)) and RELATIVE_CLAUSE.match(text)
    ] == []


def test_a_class_has_a_name_of_its_own() -> None:
    files = defaultdict(set)
    for file, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                files[node.name.lstrip("_")].add(file)
    assert {name for name in files if len(files[name]) > 1} == SHARED_NAMES


def test_the_house_has_few_words_of_its_own() -> None:
    assert len(WORDS["house"]) <= 25


def test_every_term_replaces_words_and_names_its_source() -> None:
    replaced = [old for term in WORDS["terms"] for old in term["old"]]
    assert len(replaced) == len(set(replaced))
    assert all(term["new"] and term["source"] for term in WORDS["terms"])


def modules() -> Iterator[tuple[str, ast.Module]]:
    """Yield every module of rig as its file's name and its tree."""
    for file in sorted((REPOSITORY / "rig").rglob("*.py")):
        yield file.relative_to(REPOSITORY).as_posix(), ast.parse(file.read_text("utf-8"))


def is_property(function: DOCUMENTED) -> bool:
    """Return whether a function is read as an attribute, whose docstring is a noun phrase or "Whether …"."""
    return any(getattr(decorator, "id", "") in ("property", "cached_property") for decorator in function.decorator_list)


def bindings(tree: ast.Module) -> Iterator[tuple[ast.stmt | ast.expr | ast.arg, str, str]]:
    """Yield every name that a module binds, with its node and the class whose field it is ("" otherwise)."""
    fields = {
        item.target: definition.name
        for definition in ast.walk(tree)
        if isinstance(definition, ast.ClassDef)
        for item in definition.body
        if isinstance(item, ast.AnnAssign)
    }
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED):
            yield node, node.name, ""
            for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
                yield argument, argument.arg, ""
        elif isinstance(node, ast.ClassDef):
            yield node, node.name, ""
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node, node.id, fields.get(node, "")
