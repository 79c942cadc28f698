"""The writing of a first configuration, its check, and the next steps."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.config.first_configuration import Answers

SCHEMA = "docs/config.schema.json"


def refuse_existing(path: Path) -> None:
    """Raise Refused `configuration_not_written` if the file exists."""
    if path.exists() or path.is_symlink():
        raise _not_written(path, "it is already there")


def write_checked(path: Path, answers: "Answers") -> int:
    """Write the configuration of the answers to a new file, and check it.

    Return 0, or 1 if values remain to be filled in. Raise Refused `configuration_not_written`.
    """
    from rig.config.files.safe_writing import write_new
    from rig.config.files.supplied_files import locate_supplied
    from rig.config.first_configuration import configuration_text
    from rig.config.load import ConfigurationRefused, load
    from rig.plans.procedure_registry import load_procedures, sections
    from rig.turners import turner_registry as turners

    refuse_existing(path)
    try:
        write_new(path, configuration_text(answers, _schema_from(locate_supplied(SCHEMA), path), str(path)))
    except OSError as error:
        raise _not_written(path, str(error.strerror or error)) from error
    say(f"written: {path}")
    try:
        load(path, sections=sections(load_procedures()), turners=turners.sections())
    except ConfigurationRefused as refused:
        say("to be filled in:")
        for problem in refused.problems:
            key, unknown, _ = str(problem).partition(": '?': ")
            say(f'  {key}: write the value in place of "?"' if unknown else f"  {problem}")
        say(f"then: rig check {path}")
        return 1
    say("checked: it is complete; every line can be changed")
    say("next:")
    say(f"  rig plan {path}     every motion; connects to nothing")
    say(f"  rig check {path}    connects and looks; nothing moves")
    say(f"  rig run {path}      calibrates")
    return 0


def _schema_from(schema: Path, path: Path) -> str:
    """Return the schema's path relative to the file if both lie below one folder, else its URL."""
    folder = path.resolve().parent
    if schema.is_relative_to(folder) or folder.is_relative_to(schema.parent.parent):
        return Path(os.path.relpath(schema, folder)).as_posix()
    return schema.as_uri()


def _not_written(path: Path, why: str) -> Refused:
    return Refused("configuration_not_written", f"{path} cannot be written: {why}", "Name a new file")
