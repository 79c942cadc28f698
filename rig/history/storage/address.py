"""Which history is meant: a file of the user's own unless somebody says otherwise."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.files.own_folder import own_folder
from rig.config.judging.history_address import history_url
from rig.errors import Refused

if TYPE_CHECKING:
    from sqlalchemy import URL

    from rig.config.judging.judging_sections import HistorySection

ENVIRONMENT = "RIG_HISTORY"
OFF = "off"
NAME = "history.sqlite"


@dataclass(frozen=True, slots=True)
class Place:
    """`where` is an SQLite file or a server's URL; `label` is what people are told, without any password."""

    label: str
    where: "Path | URL"


def chosen_place(section: "HistorySection", environment: Mapping[str, str] = os.environ) -> Place | None:
    """Where a run is entered: by the environment's `RIG_HISTORY`, else by its configuration; None for nowhere.

    `section` is of a configuration that the user has named or knows, never of a folder that came from somewhere.
    Raises Refused `history_address`.
    """
    said = environment.get(ENVIRONMENT)
    if said == OFF or (section.off and not said):
        return None
    return place(said or section.url)


def own_place(address: str | None) -> Place | None:
    """The user's: `address` as in a command, else in `RIG_HISTORY`, else the file of their own; None where it is off.

    Raises Refused `history_address`.
    """
    address = address or os.environ.get(ENVIRONMENT)
    return None if address == OFF else place(address)


def place(address: str | None) -> Place:
    """A file's name or a URL; None is the user's own file. Raises Refused `history_address`, and as `own_folder`."""
    if not address:
        address = str(own_folder() / NAME)
    if "://" not in address:
        try:
            path = Path(address).expanduser().absolute()
        except RuntimeError as error:  # a `~` of somebody who has no home
            remedy = "Write out the folder in --history, RIG_HISTORY or the configuration"
            raise Refused("history_address", f"the history {address} cannot be found: {error}", remedy) from None
        return Place(str(path), path)
    try:
        url = history_url(address)
    except ValueError as error:
        # Not with what was said: it may hold a password.
        raise Refused(
            "history_address",
            f"the address of the history, {address.partition('://')[0]}://…, {error}",
            "Correct it in --history, RIG_HISTORY or the configuration: docs/how-to/finished-runs/shared-history.md",
        ) from error
    if url.drivername == "sqlite":
        return place(url.database)
    return Place(url.set(password=None).render_as_string(), url.set(drivername="postgresql+psycopg"))
