"""A procedure and the file it stands in: the run folder keeps the file, so that a resumed run goes on with the same."""

import hashlib
import inspect
import sys
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from rig.errors import Refused
from rig.plans.registry import AnyProcedure, Procedure, installed, module_of


@dataclass(frozen=True, slots=True)
class ScriptFile:
    """A procedure with the name and the text of the file that defines it."""

    procedure: AnyProcedure
    name: str
    text: str

    @property
    def sha256(self) -> str:
        """Of the text, in hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def is_installed(self) -> bool:
        """Whether it is the very script that is installed under its procedure's name."""
        name = self.procedure.name
        return name in installed() and installed_script(name).sha256 == self.sha256

    def provenance(self) -> dict[str, str | bool]:
        """What a recording keeps of it."""
        return {"script": self.name, "script_sha256": self.sha256, "script_installed": self.is_installed}


def script_in(module: ModuleType, procedure: AnyProcedure) -> ScriptFile:
    """The procedure a module that is imported already defines, with the module's file."""
    path = Path(inspect.getfile(module))
    return ScriptFile(procedure, path.name, path.read_text(encoding="utf-8"))


def installed_script(name: str) -> ScriptFile:
    """An installed procedure with its file."""
    return script_in(sys.modules[module_of(name)], installed()[name])


def load_script(path: Path, name: str | None = None) -> ScriptFile:
    """The procedure a file defines as `PROCEDURE`; it stands alone, whatever folder it lies in.

    `name` is what the file is called where `path` is a copy. Raises Refused `no_script`, `script_failed`,
    `not_a_script`.
    """
    remedy = "Give a Python file that defines PROCEDURE, as procedures/six_observation.py does"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise Refused("no_script", f"the script {path} cannot be read ({error})", remedy) from error
    # Not in `sys.path`: the text alone is kept in the run folder, so it must do without its neighbours.
    spec = ModuleSpec("rig_script", None, origin=str(path))
    module = module_from_spec(spec)
    module.__file__ = str(path)
    sys.modules[spec.name] = module  # where dataclasses and models look up their annotations
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    except Exception as error:
        problem = f"{type(error).__name__}: {error}"
        raise Refused(
            "script_failed",
            f"the script {path} cannot be loaded ({problem})",
            "Mend the script; it may import what is installed, but no file beside it",
        ) from error
    procedure = getattr(module, "PROCEDURE", None)
    if not isinstance(procedure, Procedure):
        raise Refused("not_a_script", f"the script {path} defines no PROCEDURE", remedy)
    return ScriptFile(procedure, name or path.name, text)
