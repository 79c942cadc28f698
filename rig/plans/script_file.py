"""A procedure and its file. The run folder keeps the file, so that a resumed run continues with the same script."""

import hashlib
import inspect
import shlex
import sys
from dataclasses import dataclass, replace
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.data.run_folder import SCRIPT, ScriptIdentity
from rig.data.user_texts import is_own
from rig.errors import Refused
from rig.plans.procedure_registry import AnyProcedure, Procedure, load_procedures, module_of
from rig.plans.script_errors import script_errors

SIZE_MAX_BYTES = 1_000_000  # the longest procedure shipped has 3,000
REMEDY = "Give a Python file that defines PROCEDURE, as procedures/six_observation.py does"
IMPORT_REMEDY = "Correct the script; it may import what is installed, but no file of its folder"


@dataclass(frozen=True, slots=True)
class ScriptFile:
    """A procedure with the name and the text of the file that defines it."""

    procedure: AnyProcedure
    name: str
    text: str

    @property
    def identity(self) -> ScriptIdentity:
        """Identity of the script in the run folder and the recording."""
        return ScriptIdentity(self.name, _sha256(self.text))

    @property
    def sha256(self) -> str:
        """Checksum of the script's text, in hexadecimal."""
        return self.identity.sha256

    @property
    def is_installed(self) -> bool:
        """Whether the script is identical to the installed one of its procedure's name."""
        name = self.procedure.name
        return name in load_procedures() and find_installed_script(name).sha256 == self.sha256


def script_in(module: ModuleType, procedure: AnyProcedure) -> ScriptFile:
    """Return the procedure of an imported module, with the module's file."""
    path = Path(inspect.getfile(module))
    return ScriptFile(procedure, path.name, _text(path))


def find_installed_script(name: str) -> ScriptFile:
    """Return an installed procedure with its file."""
    return script_in(sys.modules[module_of(name)], load_procedures()[name])


def load_script(path: Path) -> ScriptFile:
    """Execute a file and return its `PROCEDURE`. Raise Refused `no_script`, `script_failed`, `not_a_script`."""
    return _execute(path, path.name, _text(path))


def kept_script(folder: Path, kept: ScriptIdentity, named: ScriptFile | None = None) -> ScriptFile:
    """Return the script `kept` in a run folder; the text in the folder is executed only if it is the user's own.

    A script that the user has `named` and that has the same text is returned instead. So is an installed script with
    the same text. The text in the folder is the user's own if the user has begun a run with it before. Raise Refused
    `another_script`, `foreign_script`, and what `load_script` raises.
    """
    if named is not None:
        if named.sha256 != kept.sha256:
            raise another_script(named.name)
        return replace(named, name=kept.name)
    path = folder / SCRIPT
    text = _text(path)
    if kept.sha256 != _sha256(text):
        raise another_script(str(path))
    for name in load_procedures():
        if (script := find_installed_script(name)).sha256 == kept.sha256:
            return replace(script, name=kept.name)
    if not is_own(kept.sha256):
        raise Refused(
            "foreign_script",
            f"no run of yours on this computer was begun with {path} (SHA-256 {kept.sha256[:16]}…), "
            "and a script can do anything that you can",
            f"Read it; if you trust it: --script {shlex.quote(str(path))}",
        )
    return _execute(path, kept.name, text)


def another_script(what: str) -> Refused:
    """Return the refusal of a script other than the one that began the run."""
    return Refused(
        "another_script",
        f"{what} is not the script that the run began with",
        "Undo the change in it, or start a new run with `rig run`",
    )


def _execute(path: Path, name: str, text: str) -> ScriptFile:
    """Execute the script as a module that cannot be imported, and return its PROCEDURE."""
    # Not in `sys.path`: only the script's text is kept in the run folder, so it cannot import adjacent files.
    spec = ModuleSpec("rig_script", None, origin=str(path))
    module = module_from_spec(spec)
    module.__file__ = str(path)
    sys.modules[spec.name] = module  # where dataclasses and models look up their annotations
    with script_errors(f"the script {path} cannot be loaded", IMPORT_REMEDY):
        exec(compile(text, str(path), "exec"), module.__dict__)
    procedure = getattr(module, "PROCEDURE", None)
    if not isinstance(procedure, Procedure):
        raise Refused("not_a_script", f"the script {path} defines no PROCEDURE", REMEDY)
    return ScriptFile(procedure, name, text)


def _text(path: Path) -> str:
    try:
        return read_regular_file(path, SIZE_MAX_BYTES).decode("utf-8")
    except (UnfitFile, OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refused("no_script", f"the script {path} cannot be read ({why})", REMEDY) from error


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
