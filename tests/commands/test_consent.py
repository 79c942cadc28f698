"""`rig resume` of a folder that came from elsewhere connects to nothing the user has not named."""

import socket
from pathlib import Path

import pytest
import yaml

from rig.config.load import load
from support.laboratories.commands import CI, rig_here
from support.laboratories.worlds import fresh_host


def interrupted_run(tmp_path: Path, servers: list[socket.socket]) -> tuple[Path, list[str]]:
    """Of a configuration whose arm is not there, and the addresses in it; board and history are heard if called."""
    board, history = (f"127.0.0.1:{server.getsockname()[1]}" for server in servers)
    document = yaml.safe_load(load(CI).text)
    del document["world"]
    document["arm"]["host"] = fresh_host()
    document["board"]["port"] = f"socket://{board}"
    document["history"] = {"url": f"postgresql://rig@{history}/theirs"}
    (tmp_path / "bench.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    folder = tmp_path / "run"
    assert rig_here("run", tmp_path / "bench.yaml", "--out", folder, "--yes").returncode in (2, 3)
    return folder, [document["arm"]["host"], document["board"]["port"], document["history"]["url"]]


@pytest.mark.slow
def test_a_run_of_somebody_else_connects_to_what_the_user_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    with socket.create_server(("127.0.0.1", 0)) as board, socket.create_server(("127.0.0.1", 0)) as history:
        folder, addresses = interrupted_run(tmp_path, [board, history])
        assert "foreign_folder" not in rig_here("resume", folder, "--yes").stderr  # one's own
        for server in (board, history):
            server.settimeout(0.2)
            while True:  # forget who called until now
                try:
                    server.accept()[0].close()
                except TimeoutError:
                    break
        monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "of another user"))
        asked = rig_here("resume", folder, "--yes")
        assert asked.returncode == 2 and "foreign_folder" in asked.stderr
        assert all(f"--connect {address}" in asked.stderr for address in addresses)
        some = rig_here("resume", folder, "--yes", "--connect", addresses[0], "--connect", addresses[1])
        assert "foreign_folder" in some.stderr and f"--connect {addresses[0]}" not in some.stderr
        for server in (board, history):
            with pytest.raises(TimeoutError):
                server.accept()
        named = [word for address in addresses for word in ("--connect", address)]
        assert "foreign_folder" not in rig_here("resume", folder, "--yes", *named).stderr


@pytest.mark.slow
def test_a_run_is_gone_on_with_where_its_devices_answer_now_and_nothing_else_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    with socket.create_server(("127.0.0.1", 0)) as board, socket.create_server(("127.0.0.1", 0)) as history:
        folder, (arm, begun, kept) = interrupted_run(tmp_path, [board, history])
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


@pytest.mark.slow
def test_a_configuration_that_was_changed_since_is_not_one_s_own(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as board, socket.create_server(("127.0.0.1", 0)) as history:
        folder, (host, *_) = interrupted_run(tmp_path, [board, history])
    config = folder / "config.yaml"
    config.write_text(config.read_text(encoding="utf-8").replace(host, "192.0.2.1"), encoding="utf-8")
    assert "it would connect to the arm 192.0.2.1" in rig_here("resume", folder, "--yes").stderr
