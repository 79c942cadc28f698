"""`rig resume` of a folder that came from elsewhere connects to nothing the user has not named."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from rig.config.load import load
from support.laboratories.commands import CI, rig_here
from support.laboratories.worlds import fresh_host

pytestmark = pytest.mark.slow

BOARD_PORT, HISTORY_PORT = 7321, 5432


def interrupted_run(tmp_path: Path) -> tuple[Path, list[str]]:
    """Of a configuration whose arm, board and history are not there, and their addresses in it, at one host."""
    host = fresh_host()
    document = yaml.safe_load(load(CI).text)
    del document["world"]
    document["arm"]["host"] = host
    document["board"]["port"] = f"socket://{host}:{BOARD_PORT}"
    document["history"] = {"url": f"postgresql://rig@{host}:{HISTORY_PORT}/theirs"}
    (tmp_path / "bench.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    folder = tmp_path / "run"
    assert rig_here("run", tmp_path / "bench.yaml", "--out", folder, "--yes").returncode in (2, 3)
    return folder, [host, document["board"]["port"], document["history"]["url"]]


@contextmanager
def nobody_calls(host: str) -> Iterator[None]:
    """Board and history are there, and nobody has connected to them by the end of the block."""
    with socket.create_server((host, BOARD_PORT)) as board, socket.create_server((host, HISTORY_PORT)) as history:
        yield
        for server in (board, history):
            server.setblocking(False)
            with pytest.raises(BlockingIOError):
                server.accept()


def test_a_run_of_somebody_else_connects_to_what_the_user_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    folder, addresses = interrupted_run(tmp_path)
    assert "rig: no_port: " in rig_here("resume", folder, "--yes").stderr  # one's own
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "of another user"))
    with nobody_calls(addresses[0]):
        asked = rig_here("resume", folder, "--yes")
        assert asked.returncode == 2 and "foreign_folder" in asked.stderr
        assert all(f"--connect {address}" in asked.stderr for address in addresses)
        some = rig_here("resume", folder, "--yes", "--connect", addresses[0], "--connect", addresses[1])
        assert "foreign_folder" in some.stderr and f"--connect {addresses[0]}" not in some.stderr
    named = [word for address in addresses for word in ("--connect", address)]
    assert "rig: no_port: " in rig_here("resume", folder, "--yes", *named).stderr


def test_a_run_is_gone_on_with_where_its_devices_answer_now_and_nothing_else_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    folder, (arm, begun, kept) = interrupted_run(tmp_path)
    config, now = (folder / "config.yaml").read_text(encoding="utf-8"), f"socket://{fresh_host()}:7321"
    moved = rig_here("resume", folder, "--yes", "--set", f"board.port={now}")
    assert now in moved.stderr and begun not in moved.stderr, moved.stderr
    assert (folder / "config.yaml").read_text(encoding="utf-8") == config
    other = rig_here("resume", folder, "--yes", "--set", "procedure.speed_deg_s=90")
    assert other.returncode == 2 and "no_address: " in other.stderr
    assert "arm.host, board.port" in other.stderr
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "of another user"))
    asked = rig_here("resume", folder, "--yes", "--set", f"board.port={now}")
    assert "foreign_folder" in asked.stderr and f"--connect {now}" not in asked.stderr, "it was named just now"
    assert all(f"--connect {each}" in asked.stderr for each in (arm, kept))


def test_a_configuration_that_was_changed_since_is_not_one_s_own(tmp_path: Path) -> None:
    folder, (host, *_) = interrupted_run(tmp_path)
    config = folder / "config.yaml"
    config.write_text(config.read_text(encoding="utf-8").replace(host, "192.0.2.1"), encoding="utf-8")
    assert "it would connect to the arm 192.0.2.1" in rig_here("resume", folder, "--yes").stderr
