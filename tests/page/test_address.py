"""The page's address is told once the page stays."""

from pathlib import Path

import pytest

from support.laboratories.commands import rig
from support.paths import CONFIGS

pytestmark = pytest.mark.slow


def test_a_run_that_is_refused_at_once_tells_no_address_of_a_page_that_is_gone(tmp_path: Path) -> None:
    config = CONFIGS / "ur10e_lsm9ds1.yaml"
    refused = rig(
        "run",
        config,
        "--set",
        "board.port=/dev/no-such-port",
        "--out",
        tmp_path / "run",
        "--page",
        "--page-address",
        "127.0.0.1:0",
        "--yes",
    )
    assert refused.returncode == 2 and "/dev/no-such-port" in refused.stderr
    assert "page:" not in refused.stderr and "http://" not in refused.stderr
