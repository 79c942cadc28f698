"""The error for a missing library of an optional part of the program, with the command to install it."""

from rig.errors import Refused


def missing_extra(error: ImportError, extra: str) -> Refused:
    """Return Refused `missing_extra` for a library that the optional part `extra` installs."""
    from firmware_host.installation import install_command

    return Refused(
        "missing_extra", f"the library {error.name} is not installed", f"Install it: {install_command(extra)}"
    )
