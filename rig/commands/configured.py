"""The configuration and the procedure a command is about: the one the file names, or one in a file of its own."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from rig.commands.laboratory.own_address import own_address
from rig.config.load import Loaded, load, parse
from rig.plans.phase import Phase, first_phase
from rig.plans.registry import Procedures, installed, sections
from rig.plans.script_errors import script_errors
from rig.plans.script_file import ScriptFile, installed_script, load_script
from rig.turners import registry as turners


@dataclass(frozen=True, slots=True)
class Configured:
    """A valid configuration, its procedure with the file it stands in, and the first phase of a run of it."""

    loaded: Loaded
    script: ScriptFile
    phase: Phase


def configured(config_path: Path, overrides: Sequence[str] = (), script: ScriptFile | Path | None = None) -> Configured:
    """Load a configuration, for `script` (a file or one that is loaded) if it is given, whatever procedure it names.

    Raises Refused as `load`, `installed`, `load_script` and `first_phase` do; `script_failed` too.
    """
    if isinstance(script, Path):
        script = load_script(script)
    procedures: Procedures = installed()
    if script is not None:
        procedures = {**procedures, script.procedure.name: script.procedure}
        overrides = [*overrides, f"procedure.name={script.procedure.name}"]
    # The section of a script is its own code as well.
    with script_errors(f"the section of {script.name} fails") if script is not None else nullcontext():
        loaded = load(config_path, overrides, sections(procedures), turners.sections())
    if script is None:
        script = installed_script(loaded.config.procedure.name)
    return Configured(loaded, script, first_phase(script.procedure, loaded.config, procedures))


def changed(configured: Configured, overrides: Sequence[str]) -> Configured:
    """A configuration with values changed, as `load` takes them, and its script. Raises Refused as `configured`."""
    procedures: Procedures = {**installed(), configured.script.procedure.name: configured.script.procedure}
    with script_errors(f"the section of {configured.script.name} fails"):
        loaded = parse(configured.loaded.text, "configuration", overrides, sections(procedures), turners.sections())
    return Configured(loaded, configured.script, first_phase(configured.script.procedure, loaded.config, procedures))


@contextmanager
def configured_here(
    config_path: Path, overrides: Sequence[str] = (), script: ScriptFile | Path | None = None
) -> Iterator[Configured]:
    """What `configured` has, its simulated laboratory at an address of its own for the length of the `with` block."""
    found = configured(config_path, overrides, script)
    with own_address(found.loaded.config, found.loaded.laboratory) as moved:
        yield configured(config_path, [*overrides, *moved], script and found.script) if moved else found
