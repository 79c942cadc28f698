"""A procedure and the file it stands in: the run folder keeps the file, so that a resumed run goes on with the same."""

import hashlib
import inspect
import sys
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from rig.config.regular_file import UnfitFile, read_regular_file
from rig.data.run_folder import ScriptIdentity
from rig.errors import Refused
from rig.plans.registry import AnyProcedure, Procedure, installed, module_of
from rig.plans.script_errors import script_errors

SIZE_MAX_BYTES = 1_000_000  # the longest procedure shipped has 3,000
REMEDY = "Give a Python file that defines PROCEDURE, as procedures/six_observation.py does"
IMPORTABLE = "Mend the script; it may import what is installed, but no file beside it"


@dataclass(frozen=True, slots=True)
class ScriptFile:
    """A procedure with the name and the text of the file that defines it."""

    procedure: AnyProcedure
    name: str
    text: str

    @property
    def identity(self) -> ScriptIdentity:
        """What the run folder and the recording know it by."""
        return ScriptIdentity(self.name, _sha256(self.text))

    @property
    def sha256(self) -> str:
        """Of the text, in hexadecimal."""
        return self.identity.sha256

    @property
    def is_installed(self) -> bool:
        """Whether it is the very script that is installed under its procedure's name."""
        name = self.procedure.name
        return name in installed() and installed_script(name).sha256 == self.sha256


def script_in(module: ModuleType, procedure: AnyProcedure) -> ScriptFile:
    """The procedure a module that is imported already defines, with the module's file."""
    path = Path(inspect.getfile(module))
    return ScriptFile(procedure, path.name, _text(path))


def installed_script(name: str) -> ScriptFile:
    """An installed procedure with its file."""
    return script_in(sys.modules[module_of(name)], installed()[name])


def load_script(path: Path, kept: ScriptIdentity | None = None) -> ScriptFile:
    """The procedure a file defines as `PROCEDURE`; it stands alone, whatever folder it lies in.

    `kept` is what a run knows of its script where `path` is the copy in its folder: of another text nothing is
    executed. Raises Refused `no_script`, `another_script`, `script_failed`, `not_a_script`.
    """
    text = _text(path)
    if kept is not None and kept.sha256 != _sha256(text):
        raise Refused(
            "another_script",
            f"{path} is not the script the run was begun with",
            "Undo the change in it, or start a new run with `rig run`",
        )
    # Not in `sys.path`: the text alone is kept in the run folder, so it must do without its neighbours.
    spec = ModuleSpec("rig_script", None, origin=str(path))
    module = module_from_spec(spec)
    module.__file__ = str(path)
    sys.modules[spec.name] = module  # where dataclasses and models look up their annotations
    with script_errors(f"the script {path} cannot be loaded", IMPORTABLE):
        exec(compile(text, str(path), "exec"), module.__dict__)
    procedure = getattr(module, "PROCEDURE", None)
    if not isinstance(procedure, Procedure):
        raise Refused("not_a_script", f"the script {path} defines no PROCEDURE", REMEDY)
    return ScriptFile(procedure, path.name if kept is None else kept.name, text)


def _text(path: Path) -> str:
    try:
        return read_regular_file(path, SIZE_MAX_BYTES).decode("utf-8")
    except (UnfitFile, OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refused("no_script", f"the script {path} cannot be read ({why})", REMEDY) from error


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
