"""The error for a library that only an optional part of the program brings: it names the command that brings it."""

from rig.errors import Refused


def missing_extra(error: ImportError, extra: str) -> Refused:
    """Refused `missing_extra`, for a library that the optional part `extra` installs."""
    from firmware_host.installation import install_command

    return Refused(
        "missing_extra", f"the library {error.name} is not installed", f"Install it: {install_command(extra)}"
    )
