"""The address of a history: the user's own file by default."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.files.user_folder import rig_folder
from rig.config.judging.history_address import history_url
from rig.errors import Refused

if TYPE_CHECKING:
    from sqlalchemy import URL

    from rig.config.judging.judging_sections import HistorySection

ENVIRONMENT = "RIG_HISTORY"
SWITCHED_OFF = "off"
NAME = "history.sqlite"


@dataclass(frozen=True, slots=True)
class HistoryAddress:
    """A history's address `where`: an SQLite file or a server's URL; `label` names it without a password."""

    label: str
    where: "Path | URL"


def choose_history_address(
    section: "HistorySection", environment: Mapping[str, str] = os.environ
) -> HistoryAddress | None:
    """Return a run's history, from the environment (`RIG_HISTORY`) or else the configuration; None if either is off.

    `section` must be from a configuration that the user has named or run before, never from another user's folder.
    Raise Refused `history_address`.
    """
    variable = environment.get(ENVIRONMENT)
    if variable == SWITCHED_OFF or section.is_off:
        return None
    return resolve_address(variable or section.url)


def default_history_address(address: str | None) -> HistoryAddress | None:
    """Return the user's history; None if it is switched off.

    The history is at the command's `address`, else at `RIG_HISTORY`, else the user's own. Raise Refused
    `history_address`.
    """
    address = address or os.environ.get(ENVIRONMENT)
    return None if address == SWITCHED_OFF else resolve_address(address)


def resolve_address(address: str | None) -> HistoryAddress:
    """Return the history at a file's name or a URL; None means the user's own file. Raise Refused `history_address`."""
    if not address:
        address = str(rig_folder() / NAME)
    if "://" not in address:
        try:
            path = Path(address).expanduser().absolute()
        except RuntimeError as error:  # `~` of a user without a home folder
            remedy = "Write out the folder in --history, RIG_HISTORY or the configuration"
            raise Refused("history_address", f"the history {address} cannot be found: {error}", remedy) from None
        return HistoryAddress(str(path), path)
    try:
        url = history_url(address)
    except ValueError as error:
        # Without the address itself: it may contain a password.
        raise Refused(
            "history_address",
            f"the address of the history, {address.partition('://')[0]}://…, {error}",
            "Correct it in --history, RIG_HISTORY or the configuration: a file, or postgresql://USER@HOST:PORT/DATABASE",
        ) from error
    if url.drivername == "sqlite":
        return resolve_address(url.database)
    return HistoryAddress(url.set(password=None).render_as_string(), url.set(drivername="postgresql+psycopg"))
