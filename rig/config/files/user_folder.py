"""The user's folder of the rig: hashes of texts that the user has run, a history, and autopilots' old parameters."""

from pathlib import Path

from rig.errors import Refused


def rig_folder() -> Path:
    """Return the user's folder of the rig, which may not exist yet. Raise Refused `no_home` without a home folder."""
    from platformdirs import user_data_path

    try:
        folder = user_data_path("calibration-rig", appauthor=False)
    except RuntimeError as error:
        raise _no_home(str(error)) from None
    if not folder.is_absolute():  # older versions of the library return this: a folder that is called `~`
        raise _no_home(f"there is no folder {folder}")
    return folder


def _no_home(why: str) -> Refused:
    return Refused("no_home", f"no home of this user is known: {why}", "Set HOME to a folder of yours")
