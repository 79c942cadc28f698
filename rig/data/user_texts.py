"""Configurations and scripts that the user of this computer has run, recognized by their text in any folder.

Each text has an empty file, named by the text's SHA-256, in the user's own folder, so that nothing needs to be parsed
or locked.
"""

import hashlib
from contextlib import suppress
from pathlib import Path

from rig.config.files.user_folder import rig_folder
from rig.errors import Refused


def note_own(*texts: str) -> None:
    """Record that this user has run these configurations or scripts. If this fails, the user is asked again later."""
    with suppress(OSError, Refused):
        folder = _folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for text in texts:
            (folder / hashlib.sha256(text.encode()).hexdigest()).touch()


def is_own(sha256: str) -> bool:
    """Return whether this user has run the configuration or script of this hash (hexadecimal) on this computer."""
    with suppress(Refused):
        return len(sha256) == 64 and sha256.isalnum() and (_folder() / sha256).is_file()
    return False


def _folder() -> Path:
    """Return the folder of the files named by hashes. Raise as `rig_folder` does."""
    return rig_folder() / "own"
