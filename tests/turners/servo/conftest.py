"""What tests of the servo's driver have in common."""

import pytest


@pytest.fixture(autouse=True)
def no_crowd(monkeypatch: pytest.MonkeyPatch) -> None:
    """The driver's clock stands while the machine is busy, so it stretches no limit for a crowd."""
    for module in ("driver", "link"):
        monkeypatch.setattr(f"rig.turners.servo.{module}.crowding", lambda: 1.0)
