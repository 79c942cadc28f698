"""The code has the words of rig/report/words/words.toml, and names and docstrings as CONTRIBUTING.md asks."""

import ast
import gc
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
WORDS = tomllib.loads((REPOSITORY / "rig/report/words/words.toml").read_text("utf-8"))
FIELD_TERMS = {old: term["new"] for term in WORDS["terms"] for old in term["old"]}
NEVER_BOUND = frozenset(WORDS["never_bound"])
# The simulated controller has its own modes, as a real one has; a notebook's run is what its reader calls a run.
SHARED_CLASSES = {"RobotMode", "Run", "RuntimeState", "SafetyMode"}
# A function's name begins with a verb. So many do not yet; whoever renames one lowers the number, and none is added.
NAMES_WITHOUT_VERB = 46
PREPOSITIONS = frozenset(WORDS["prepositions"])
NOT_PARTICIPLES = {"feed", "speed", "seed", "need", "read", "embed"}
RELATIVE_CLAUSE = re.compile(
    r"(\([^)]*\)[,:]? ?)?(what|whether|how|where|who|whom|which|when|why|that)\b", re.IGNORECASE
)
SHAPE = re.compile(r"\([^)]*\)[,:]? ?")  # "(3,) biases" begins with the biases
POINTS_ELSEWHERE = (
    *("it", "its", "they", "them", "their", "this", "that", "these", "those", "both", "none", "nothing", "all but one"),
    *("the same", "as", "or", "and", "but", "also", "always", "never", "only", "not", "all of it", "all of them"),
    *("of", "by", "in", "into", "on", "at", "to", "for", "with", "without", "between", "until", "before", "after"),
    *("out of", "inside", "since", "while", "unless", "under", "around", "along", "less", "just", "from now on"),
    *(".", ","),
)
WITHOUT_SUBJECT = re.compile(rf"({'|'.join(map(re.escape, POINTS_ELSEWHERE))})(\W|$)|$", re.IGNORECASE)
# The names before a colon or a shape: at the beginning of an item of a list, and in backticks also within it.
LISTED = re.compile(r"(?:^- |; )(`\w+`(?:, `\w+`)*)(?=:| \()|^- (\w+(?:, \w+)*)(?=:| \()", re.MULTILINE)
WIDE, IN_PROSE = 8, 10  # fields of a class, and names in the prose of its docstring
CAPABILITIES = frozenset(WORDS["capabilities"])
DOCUMENTED = ast.FunctionDef | ast.AsyncFunctionDef


@pytest.mark.slow
def test_a_name_says_what_it_is_bound_to() -> None:
    assert [
        f"{file}:{node.lineno}: {name}: {term_for(name)}"
        for file, nodes in modules()
        for node, name in bindings(nodes)
        if name.strip("_").lower() in NEVER_BOUND
    ] == []


def test_no_docstring_of_a_function_opens_with_a_relative_clause() -> None:
    """PEP 257: a verb first."""
    assert [
        f'{file}:{node.lineno}: "{text.splitlines()[0]}": begin with a verb, such as Return or Yield'
        for file, nodes in modules()
        for node in nodes
        if isinstance(node, DOCUMENTED) and not is_property(node)
        if (text := ast.get_docstring(node)) and RELATIVE_CLAUSE.match(text)
    ] == []


def test_a_class_has_a_name_of_its_own() -> None:
    files = defaultdict(set)
    for file, nodes in modules():
        for node in nodes:
            if isinstance(node, ast.ClassDef):
                files[node.name.lstrip("_")].add(file)
    assert {name: files[name] for name in files if len(files[name]) > 1 and name not in SHARED_CLASSES} == {}


def test_the_name_of_a_function_begins_with_a_verb() -> None:
    without = [
        f"{file}:{node.lineno}: {node.name}: begin with a verb, such as find, fit or average; {term_for(node.name)}"
        for file, nodes in modules()
        for node in nodes
        if isinstance(node, DOCUMENTED) and not is_property(node) and not begins_with_verb(node.name)
    ]
    assert len(without) <= NAMES_WITHOUT_VERB, without


def test_a_module_has_a_name_of_its_own_unless_it_names_a_capability() -> None:
    files = defaultdict(set)
    for file, _ in modules():
        if not file.endswith("__init__.py"):
            files[Path(file).stem].add(file)
    shared = {name for name, of in files.items() if len(of) > 1}
    assert [
        f"{', '.join(sorted(files[name]))}: say more, as arm_driver for driver, or name a capability of words.toml"
        for name in sorted(shared - CAPABILITIES)
    ] == []
    assert len(CAPABILITIES) <= 25 and shared >= CAPABILITIES, CAPABILITIES - shared


def test_a_wide_class_lists_its_fields() -> None:
    """A line each: "- name (shape): meaning". Names in a running sentence are in backticks, so these are counted."""
    assert [
        f"{file}:{node.lineno}: {node.name} has {fields} fields in running sentences: one line a field, - name: meaning"
        for file, nodes in modules()
        for node in nodes
        if isinstance(node, ast.ClassDef)
        if (fields := sum(isinstance(item, ast.AnnAssign) for item in node.body)) >= WIDE
        if len(re.findall(r"`\w+`", ast.get_docstring(node) or "")) >= IN_PROSE
    ] == []


def test_the_list_of_a_class_names_its_own_fields() -> None:
    """A renamed field is renamed in its line too: "- `name`, `other` (shape): meaning", with or without backticks."""
    assert [
        f"{file}:{node.lineno}: {node.name} has no field {name}, which its docstring lists"
        for file, nodes in modules()
        for node in nodes
        if isinstance(node, ast.ClassDef) and (fields := fields_of(node))
        if (text := ast.get_docstring(node)) and "\n- " in text
        for names in LISTED.findall(text)
        for name in re.findall(r"\w+", " ".join(names))
        if name not in fields
    ] == []


def test_the_summary_of_a_docstring_is_one_line() -> None:
    """PEP 257."""
    assert [
        f'{file}:{getattr(node, "lineno", 1)}: "{summary[0]}" goes on: end the sentence, then a blank line'
        for file, nodes in modules()
        for node in nodes
        if isinstance(node, DOCUMENTED | ast.ClassDef | ast.Module)
        if len(summary := (ast.get_docstring(node) or "").split("\n\n")[0].splitlines()) > 1
    ] == []


def test_every_docstring_begins_with_what_it_is_about() -> None:
    """`help()` of one module, class or function alone tells what it is."""
    assert [
        f"{file}:{getattr(node, 'lineno', 1)}: {text.splitlines()[0]}"
        for file, nodes in (*modules(), *modules("firmware_host"))
        for node in nodes
        if isinstance(node, DOCUMENTED | ast.ClassDef | ast.Module)
        if (text := ast.get_docstring(node)) is not None
        if WITHOUT_SUBJECT.match(SHAPE.sub("", text, count=1) if text[0] == "(" else text)
    ] == []


def test_the_house_has_few_words_of_its_own() -> None:
    assert len(WORDS["house"]) <= 25


def test_every_term_replaces_words_and_names_its_source() -> None:
    replaced = [old for term in WORDS["terms"] for old in term["old"]]
    assert len(replaced) == len(set(replaced))
    assert all(term["new"] and term["source"] for term in WORDS["terms"])


def term_for(name: str) -> str:
    """Return the term to use for the private words of a name, by words.toml."""
    words = [word for word in name.strip("_").lower().split("_") if word in FIELD_TERMS]
    return "; ".join(f"for {word}: {FIELD_TERMS[word]}" for word in words) or "name it by what it holds"


@cache
def modules(package: str = "rig") -> tuple[tuple[str, list[ast.AST]], ...]:
    """Return every module of a package as its file's name and the nodes that have a name or a docstring."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef, ast.Name)
    files = sorted((REPOSITORY / package).rglob("*.py"))
    gc.disable()  # which would look through a million nodes again and again
    try:
        trees = {file.relative_to(REPOSITORY).as_posix(): ast.parse(file.read_text("utf-8")) for file in files}
        return tuple(
            (file, [node for node in ast.walk(tree) if isinstance(node, kinds)]) for file, tree in trees.items()
        )
    finally:
        gc.enable()


def begins_with_verb(name: str) -> bool:
    """Return whether a name begins neither with a participle nor a preposition nor a word of `never_bound`."""
    word = name.strip("_").split("_")[0]
    is_participle = word.endswith("ed") and word not in NOT_PARTICIPLES
    return word not in PREPOSITIONS and not is_participle and word not in NEVER_BOUND


def fields_of(node: ast.ClassDef) -> set[str]:
    """Return the names that a class annotates in its body."""
    return {
        item.target.id for item in node.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
    }


def is_property(function: DOCUMENTED) -> bool:
    """Return whether a function is read as an attribute, whose docstring is a noun phrase or "Whether …"."""
    return any(getattr(decorator, "id", "") in ("property", "cached_property") for decorator in function.decorator_list)


def bindings(nodes: list[ast.AST]) -> Iterator[tuple[ast.stmt | ast.expr | ast.arg, str]]:
    """Yield every name that a module's nodes bind, each with its node."""
    for node in nodes:
        if isinstance(node, DOCUMENTED):
            yield node, node.name
            for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
                yield argument, argument.arg
        elif isinstance(node, ast.ClassDef):
            yield node, node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node, node.id
