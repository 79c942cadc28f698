"""Which history is meant: a file of the user's own unless somebody says otherwise."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rig.config.judging_sections import HistorySection

ENVIRONMENT = "RIG_HISTORY"
OFF = "off"
NAME = "history.sqlite"


@dataclass(frozen=True, slots=True)
class Place:
    """A history's `url` as SQLAlchemy takes it; `label` is what people are told, without any password."""

    url: str
    label: str

    @property
    def file(self) -> Path | None:
        """The SQLite file, None of a server's."""
        return Path(self.url.removeprefix("sqlite:///")) if self.url.startswith("sqlite:") else None


def chosen_place(section: HistorySection, environment: Mapping[str, str] = os.environ) -> Place | None:
    """Where a run is entered: by the environment's `RIG_HISTORY`, else by the configuration; None for nowhere."""
    said = environment.get(ENVIRONMENT)
    if said == OFF or (section.off and not said):
        return None
    return place(said or section.url)


def place(said: str | None) -> Place:
    """A file's name or a URL; None is the user's own file."""
    if not said:
        from platformdirs import user_data_path

        said = str(user_data_path("calibration-rig", appauthor=False) / NAME)
    scheme, mark, rest = said.partition("://")
    if not mark:
        path = Path(said).expanduser().absolute()
        return Place(f"sqlite:///{path}", str(path))
    if scheme == "sqlite":
        return place(rest.removeprefix("/") if rest.startswith("/") else rest)
    user, at, host = rest.rpartition("@")
    label = f"{scheme}://{user.partition(':')[0]}{at}{host.partition('?')[0]}"
    return Place(f"postgresql+psycopg://{rest}" if scheme == "postgresql" else said, label)
