"""`--notify`: a command is run when a run has ended, however it ended, and changes nothing."""

from pathlib import Path

import pytest

from rig.commands.measure.notice import notify_after
from rig.errors import Fault, Refused

TELL = 'echo "$RIG_STATUS $RIG_RUN" > told.txt'


def work_that(ends: BaseException | int) -> int:
    if isinstance(ends, BaseException):
        raise ends
    return ends


@pytest.mark.parametrize(
    ("ends", "status"),
    [(0, 0), (1, 1), (Refused("r", "w", "r"), 2), (Fault("f", "w", "r"), 3), (KeyboardInterrupt(), 130)],
)
def test_it_is_told_how_the_run_ended(
    ends: BaseException | int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if isinstance(ends, BaseException):
        with pytest.raises(type(ends)):
            notify_after(TELL, Path("run"), lambda: work_that(ends))
    else:
        assert notify_after(TELL, Path("run"), lambda: work_that(ends)) == status
    assert (tmp_path / "told.txt").read_text(encoding="utf-8") == f"{status} {tmp_path / 'run'}\n"


def test_a_command_that_fails_changes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert notify_after("exit 7", tmp_path, lambda: 0) == 0
    assert "the command of --notify failed: it ended with status 7" in capsys.readouterr().err
