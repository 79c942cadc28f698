"""The errors that the source raises, read from its syntax: names are written out where an error is made."""

import ast
import functools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from support.paths import ROOT

PACKAGES = ("rig", "firmware_host", "procedures")
THE_FORM_ITSELF = ROOT / "firmware_host" / "problem.py"
# constructor of an error from name, what and remedy → the catalogue's kind
MAKERS = {
    "Refused": "refused",
    "Fault": "fault",
    "Unprinted": "unprinted",
    "RigError": "either",
    "BoardError": "either",
    "SensorError": "either",
    "Problem": "either",
    "Violation": "simulated",
}
FIELDS = 3  # name, what, remedy


@dataclass(frozen=True, slots=True)
class Raised:
    """An error made at `location`, "file:line". `name` is None if it is not written out there."""

    name: str | None
    kind: str
    location: str


@functools.cache
def find_errors() -> list[Raised]:
    """Return every error made in the packages, by file and line."""
    files = sorted({file for package in PACKAGES for file in (ROOT / package).rglob("*.py")} - {THE_FORM_ITSELF})
    texts = {file.relative_to(ROOT): file.read_text(encoding="utf-8") for file in files}
    return [
        error
        for file, text in texts.items()
        if any(maker in text for maker in MAKERS)  # in others none is made
        for error in find_errors_in(text, file)
    ]


def find_errors_in(source: str, file: Path) -> list[Raised]:
    """Return every error made in one file's text."""
    module = _Module(ast.parse(source))
    return [
        Raised(name, kind, f"{file}:{call.lineno}")
        for call, kind in module.errors()
        for name in module.names(call.args[0], call)
    ]


def kind_of(raised: Sequence[Raised]) -> str:
    """Return the catalogue's kind of an error that is raised in all these places."""
    kinds = {error.kind for error in raised}
    return kinds.pop() if len(kinds) == 1 else "either"


def _spell_dotted(called: ast.expr) -> str:
    """Return a called expression as written; `ast.unparse` takes a hundred times as long."""
    match called:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=of, attr=name):
            return f"{_spell_dotted(of)}.{name}"
        case ast.Call(func=function):
            return f"{_spell_dotted(function)}()"
    return ""


class _Module:
    """A module's tree, in which a name is followed through parameters to callers and through variables to values."""

    def __init__(self, tree: ast.Module) -> None:
        self._functions: dict[ast.AST, ast.FunctionDef] = {}  # node → the innermost function it stands in
        self._bases: dict[ast.AST, str] = {}  # node → the maker that its class derives from
        self._calls: dict[str, list[ast.Call]] = defaultdict(list)
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                self._functions |= dict.fromkeys(ast.walk(node), node)
            elif isinstance(node, ast.ClassDef):
                maker = next((ast.unparse(base) for base in node.bases if ast.unparse(base) in MAKERS), None)
                self._bases |= dict.fromkeys(ast.walk(node), maker) if maker else {}
            elif isinstance(node, ast.Call):
                self._calls[_spell_dotted(node.func).removeprefix("self.")].append(node)

    def errors(self) -> Iterator[tuple[ast.Call, str]]:
        for name, calls in self._calls.items():
            for call in calls:
                maker = self._bases.get(call) if name == "super().__init__" else name
                if maker in MAKERS and len(call.args) == FIELDS:
                    yield call, MAKERS[maker]

    def names(self, expression: ast.expr, call: ast.Call) -> set[str | None]:
        """Return the possible first arguments of `call`; none for `problem.name`, an error from elsewhere."""
        match expression:
            case ast.Constant(value=str(name)):
                return {name}
            case ast.IfExp(body=body, orelse=other):
                return self.names(body, call) | self.names(other, call)
            case ast.Attribute(attr="name"):
                return set()
            case ast.Name(id=variable) if call in self._functions:
                return self._values(variable, self._functions[call]) or {None}
        return {None}

    def _values(self, variable: str, function: ast.FunctionDef) -> set[str | None]:
        parameters = [argument.arg for argument in function.args.args if argument.arg != "self"]
        if variable in parameters:
            index = parameters.index(variable)
            arguments = [
                (call.args[index], call) for call in self._calls.get(function.name, ()) if len(call.args) > index
            ]
        else:
            arguments = [
                (node.value, next(node for node in ast.walk(function) if isinstance(node, ast.Call)))
                for node in ast.walk(function)
                if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == variable
            ]
        return {name for value, call in arguments for name in self.names(value, call)}
