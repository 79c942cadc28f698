"""A user of whom no home is known, as in a container: nothing is written into a folder that is called `~`."""

import os
from pathlib import Path

import pytest

from rig.config.files.user_folder import rig_folder
from rig.data.user_texts import is_own, note_own
from rig.errors import Refused
from rig.history.storage.address import resolve_address

NOBODY = 987_654


@pytest.fixture(autouse=True)
def homeless(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("HOME", "XDG_DATA_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "getuid", lambda: NOBODY)
    monkeypatch.chdir(tmp_path)


def test_a_folder_of_ones_own_needs_a_home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(Refused, match="no_home: no home of this user is known"):
        rig_folder()
    monkeypatch.setenv("HOME", str(tmp_path))
    assert rig_folder().is_relative_to(tmp_path)


def test_a_history_without_a_home_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="no_home"):
        resolve_address(None)
    with pytest.raises(Refused, match="history_address: the history ~/of the laboratory"):
        resolve_address("~/of the laboratory")
    assert resolve_address(str(tmp_path / "history")).where == tmp_path / "history"


def test_what_was_run_is_not_known_later_and_lies_nowhere(tmp_path: Path) -> None:
    note_own("text")
    assert not is_own("0" * 64)
    assert not any(tmp_path.iterdir())
