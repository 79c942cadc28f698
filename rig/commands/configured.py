"""The configuration of a command and its procedure, which the configuration names or a script contains."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from rig.commands.laboratory.own_address import find_own_address
from rig.config.load import Loaded, load, parse
from rig.plans.phase import Phase, first_phase
from rig.plans.procedure_registry import Procedures, load_procedures, sections
from rig.plans.script_errors import script_errors
from rig.plans.script_file import ScriptFile, find_installed_script, load_script
from rig.turners import turner_registry as turners


@dataclass(frozen=True, slots=True)
class Configured:
    """A valid configuration, its procedure with the file that defines it, and the first phase of its run."""

    loaded: Loaded
    script: ScriptFile
    phase: Phase


def load_configured(
    config_path: Path, overrides: Sequence[str] = (), script: ScriptFile | Path | None = None
) -> Configured:
    """Load and return a configuration. A `script` (a file, or loaded) replaces the configuration's procedure.

    Raise Refused `script_failed`, and what `load`, `load_procedures`, `load_script` and `first_phase` raise.
    """
    if isinstance(script, Path):
        script = load_script(script)
    procedures: Procedures = load_procedures()
    if script is not None:
        procedures = {**procedures, script.procedure.name: script.procedure}
        overrides = [*overrides, f"procedure.name={script.procedure.name}"]
    # The section of a script is the script's own code as well.
    with script_errors(f"the section of {script.name} fails") if script is not None else nullcontext():
        loaded = load(config_path, overrides, sections(procedures), turners.sections())
    if script is None:
        script = find_installed_script(loaded.config.procedure.name)
    return Configured(loaded, script, first_phase(script.procedure, loaded.config, procedures))


def change_configured(configured: Configured, overrides: Sequence[str]) -> Configured:
    """Return the configuration changed by `overrides` (`key=value`). Raise Refused as `load_configured` does."""
    procedures: Procedures = {**load_procedures(), configured.script.procedure.name: configured.script.procedure}
    with script_errors(f"the section of {configured.script.name} fails"):
        loaded = parse(configured.loaded.text, "configuration", overrides, sections(procedures), turners.sections())
    return Configured(loaded, configured.script, first_phase(configured.script.procedure, loaded.config, procedures))


@contextmanager
def open_configured(
    config_path: Path, overrides: Sequence[str] = (), script: ScriptFile | Path | None = None
) -> Iterator[Configured]:
    """Load and yield as `load_configured` does; during the block a simulated laboratory has its own address."""
    configured = load_configured(config_path, overrides, script)
    with find_own_address(configured.loaded.config, configured.loaded.laboratory) as moved:
        yield load_configured(config_path, [*overrides, *moved], script and configured.script) if moved else configured
