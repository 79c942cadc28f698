"""The shipped image on the emulated chip, where parts and chip are as real ones may be."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from firmware_host.emulator.chip.flash_memory import PAGE_BYTES
from firmware_host.emulator.parts.adis16465 import Adis16465
from firmware_host.emulator.parts.lsm9ds1 import Lsm9ds1
from firmware_host.frames import encode
from support.board import emulated_session
from support.board.emulated_session import FIRST_RECORD, Session, make_shipped_flash, samples

pytestmark = pytest.mark.slow

PER_COUNT_RAD_S = math.radians(1 / 40)  # of an ADIS16465-2


class OvertakenGyro(Lsm9ds1):
    """Now and then it has converted again before its line was seen to fall: the line stays up without an edge."""

    held = 0  # so many times: at every fiftieth conversion

    def transfer(self, byte: int, time_s: float) -> int:
        was_fresh = self.interrupt_level
        answer = super().transfer(byte, time_s)
        if was_fresh and not self.interrupt_level and self._conversions.count // 50 > self.held:
            self._convert(time_s)
            self.held = self._conversions.count // 50
        return answer


def adis16465_session() -> tuple[Session, Adis16465]:
    session = Session(parts=["adis16465"], noise_rad_s=0.0, boot_time_s=0.0)
    session.run(0.1)
    part = session.sensors["adis16465"]
    assert isinstance(part, Adis16465)
    return session, part


def mean_rate(session: Session) -> np.ndarray:
    """(3,) rad/s of half a second."""
    session.board.receive(encode("start", 77, {"sensors": 0}))
    counts = samples(session.run(0.5), sensor=2)["counts"]
    session.ask("stop")
    return np.asarray(counts.mean(axis=0) * PER_COUNT_RAD_S)


def write_bias(part: Adis16465, axis: int, counts: int) -> None:
    """As somebody else's program did, long ago."""
    part.select(0.0)
    part._registers.values[0x42 + 4 * axis] = counts & 0xFFFF
    part.deselect(0.0)


def test_a_bias_that_somebody_stored_in_the_adis16465_is_not_in_the_readings() -> None:
    session, part = adis16465_session()
    session.configure("adis16465")
    clean = mean_rate(session)
    for axis, counts in enumerate((100, -200, 300)):
        write_bias(part, axis, counts)
    stained = mean_rate(session)
    assert stained - clean == pytest.approx(np.array((100, -200, 300)) * PER_COUNT_RAD_S, rel=1e-3)
    session.board.reset()
    session.run(0.1)
    session.configure("adis16465")
    assert mean_rate(session) == pytest.approx(clean, abs=1e-9)


def test_an_adis16465_whose_data_path_was_overrun_is_reset_when_it_is_configured() -> None:
    session, part = adis16465_session()
    part.overrun = True
    session.board.receive(
        encode("configure", 9, {"sensor": 2, "rate_hz": 200.0, "range_deg_s": 500.0, "range_g": 0, "range_gauss": 0})
    )
    assert "setup" in [frame.name for frame in session.run(0.4)]
    assert not part.overrun
    assert np.all(np.abs(mean_rate(session)) > 0)
    report = session.ask("status").values
    assert (report["bus_errors"], report["reset_cause"]) == (0, 1), "the watchdog waited"


def test_a_line_left_high_does_not_stop_the_stream(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[OvertakenGyro] = []

    def overtaken(*arguments: Any, **more: Any) -> OvertakenGyro:
        made.append(OvertakenGyro(*arguments, **more))
        return made[0]

    parts: dict[str, Callable[..., object]] = {**emulated_session.PARTS, "lsm9ds1": overtaken}
    monkeypatch.setattr(emulated_session, "PARTS", parts)
    session = Session(boot_time_s=0.0)
    session.run(0.1)
    found = session.stream(4.0)
    frames = session.run(0.2)
    assert made[0].held > 5
    assert [frame for frame in frames if frame.name == "error"] == []
    gaps = np.diff(found["time_us"].astype(float))
    assert gaps.max() < 2.5 * np.median(gaps), "no tenth of a second is lost"


def test_both_dies_of_the_lsm9ds1_and_the_mpu9250_are_kept_off_i2c_from_the_start() -> None:
    session = Session(parts=("lsm9ds1", "mpu9250", "lsm9ds1_magnetometer"), boot_time_s=0.0)
    session.run(0.6)  # the board has said once who it is
    assert registers(session, "lsm9ds1_magnetometer")[0x22] == 0x83, "and powered down"
    assert registers(session, "lsm9ds1")[0x23] == 0x04
    assert registers(session, "mpu9250")[0x6A] == 0x10


def registers(session: Session, part: str) -> Sequence[int] | dict[int, int]:
    found: dict[int, int] = session.sensors[part]._registers.values  # pyrefly: ignore[missing-attribute]  # every model has them
    return found


def test_torn_pages_whose_flag_the_chip_has_lost_do_not_keep_the_board_from_its_work() -> None:
    flash = make_shipped_flash()
    flash.torn.update(range(FIRST_RECORD, FIRST_RECORD + 2 * PAGE_BYTES, 8))
    flash.flags_lost = True
    session = Session(flash=flash, boot_time_s=0.0)
    session.run(0.1)
    session.configure("lsm9ds1")
    assert session.ask("read_calibration", sensor=0).name == "error"
    assert session.ask("erase_calibration", sensor=0).name == "ack"
    report = session.ask("status").values
    assert (report["fault_pc"], report["reset_cause"]) == (0, 1)
    assert flash.torn == set()
