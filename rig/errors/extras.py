"""The error for a missing library of an optional part of the program, with the command to install it."""

from collections.abc import Iterator
from contextlib import contextmanager

from rig.errors import Refused


@contextmanager
def requiring(extra: str) -> Iterator[None]:
    """Import libraries of the optional part `extra` in the block. Raise Refused `missing_extra` without them."""
    try:
        yield
    except ImportError as error:
        raise missing_extra(error, extra) from error


def missing_extra(error: ImportError, extra: str) -> Refused:
    """Return Refused `missing_extra` for a library that the optional part `extra` installs."""
    from firmware_host.installation import install_command

    return Refused(
        "missing_extra", f"the library {error.name} is not installed", f"Install it: {install_command(extra)}"
    )
