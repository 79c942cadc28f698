"""The simulated ADIS16465 at its registers, against its data sheet: what is its own beside what every part does."""

import math
from itertools import pairwise

import pytest

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.parts.adis16465 import Adis16465
from firmware_host.emulator.parts.gyroscope import GyroTruth
from support.board.spi_master import integers
from support.parts.adis16465 import Adis16465Driver

DIAG_STAT, X_GYRO_LOW, DATA_CNTR = 0x02, 0x04, 0x22
FILT_CTRL, RANG_MDL, MSC_CTRL, DEC_RATE, GLOB_CMD, PROD_ID = 0x5C, 0x5E, 0x60, 0x64, 0x68, 0x72
PER_COUNT = math.radians(1 / 40)
RATE = (1.0, -0.5, 2e-4)


def turning() -> Adis16465Driver:
    return Adis16465Driver(lambda _time_s: RATE)


def test_an_answer_comes_with_the_next_frame() -> None:
    driver = Adis16465Driver()
    answers = [driver.exchange(bytes([address, 0])) for address in (PROD_ID, RANG_MDL, MSC_CTRL, 0)]
    assert [answer.hex() for answer in answers[1:]] == ["4051", "0007", "00c1"]


@pytest.mark.parametrize(("range_deg_s", "model"), [(125, 0x0003), (500, 0x0007), (2000, 0x000F)])
def test_the_range_is_the_variants(range_deg_s: int, model: int) -> None:
    assert Adis16465Driver(range_deg_s=range_deg_s).get(RANG_MDL) == model


def test_frames_need_their_pause() -> None:
    driver = Adis16465Driver()
    driver.exchange(bytes([PROD_ID, 0]))
    driver.part.select(driver.time_s + 15e-6)
    with pytest.raises(Violation, match=r"15\.0 µs after the last") as caught:
        driver.part.transfer(0, driver.time_s + 15e-6)
    assert caught.value.name == "spi_stall"
    with pytest.raises(Violation, match="no pause"):
        Adis16465Driver().exchange(bytes([PROD_ID, 0, PROD_ID, 0]))


def test_a_burst_is_status_rates_accelerations_temperature_counter_and_their_sum() -> None:
    driver = turning()
    driver.await_data()
    data = driver.burst()
    status, *rates, x, y, z, temperature, counter = integers(data[:18], ">")
    assert status == 0
    assert rates == [round(rate / PER_COUNT) for rate in RATE]
    assert (x, y, z) == (0, 0, 4000)  # at rest, z up
    assert temperature == 250
    assert counter == 1
    assert int.from_bytes(data[18:], "big") == sum(data[:18])


def test_a_burst_ends_where_it_ends() -> None:
    with pytest.raises(Violation, match="10 words") as caught:
        turning().exchange(bytes([GLOB_CMD]) + bytes(23))
    assert caught.value.name == "spi_frame"


def test_a_burst_can_be_told_beforehand() -> None:
    told, spoken = turning(), turning()
    for driver in (told, spoken):
        driver.await_data()
    part, time_s = told.part, told.time_s + 1e-3
    part.select(time_s)
    part.transfer(GLOB_CMD, time_s)
    part.transfer(0, time_s)
    assert part.predict() == spoken.burst()
    with pytest.raises(Violation, match="10 words"):
        part.transfer(0, time_s)
    part.deselect(time_s)
    part.select(time_s + 1e-3)
    assert part.predict() == b""


def test_a_burst_is_slow() -> None:
    part = Adis16465Driver().part
    for first, max_hz in ((PROD_ID, 2e6), (GLOB_CMD, 1e6)):
        part.select(1.0)
        part.transfer(first, 1.0)
        assert part.spi_max_hz == max_hz
        part.deselect(1.0)
        part = Adis16465Driver().part


def test_a_broken_frame_is_told_once() -> None:
    driver = Adis16465Driver()
    driver.exchange(bytes([PROD_ID]))
    driver.await_data()
    assert driver.get(DIAG_STAT) == 1 << 3
    assert driver.get(DIAG_STAT) == 0
    driver.exchange(bytes([PROD_ID]))
    assert integers(driver.burst()[:2], ">") == [1 << 3]
    assert integers(driver.burst()[:2], ">") == [0]


def test_the_counter_counts_the_updates() -> None:
    driver = Adis16465Driver()
    driver.start(200.0, 500.0)
    counts = []
    for _ in range(3):
        driver.await_data()
        counts.append(driver.get(DATA_CNTR))
    assert [b - a for a, b in pairwise(counts)] == [1, 1]


def test_low_words_carry_what_averaging_adds() -> None:
    def outputs(driver: Adis16465Driver) -> list[int]:
        """Rates, then accelerations, 32 bits each."""
        driver.await_data()
        words = [driver.get(X_GYRO_LOW + 2 * word) for word in range(12)]
        return [low | high << 16 for low, high in zip(words[::2], words[1::2], strict=True)]

    force_g = (0.10003, -0.20004, 0.9)
    in_counts = [*(rate / PER_COUNT for rate in RATE), *(4000 * force for force in force_g)]
    driver = Adis16465Driver(lambda _time_s: (*RATE, *force_g))
    assert outputs(driver) == [round(counts) << 16 & 0xFFFF_FFFF for counts in in_counts]
    driver.start(200.0, 500.0)
    assert outputs(driver) == [round(counts * 65536) & 0xFFFF_FFFF for counts in in_counts]


def test_the_upper_word_alone_is_rounded_down_when_it_averages() -> None:
    driver = turning()
    driver.start(200.0, 500.0)
    driver.await_data()
    assert driver.read()[0] == [math.floor(rate / PER_COUNT) for rate in RATE]


@pytest.mark.parametrize(("polarity", "high"), [(0x00C1, True), (0x00C0, False)])
def test_data_ready_rests_while_the_registers_change(polarity: int, high: bool) -> None:
    driver = Adis16465Driver()
    driver.set(MSC_CTRL, polarity)
    driver.advance(0.1)
    levels = []
    times_s = []
    for _ in range(6):
        driver.advance(driver.part.next_event_s)
        levels.append(driver.part.interrupt_level == high)
        times_s.append(driver.time_s)
    assert levels == [not levels[1], levels[1]] * 3
    valid_s = times_s[levels.index(True)]
    assert times_s[levels.index(True) + 2] - valid_s == pytest.approx(1 / 2000)
    resting_s = [b - a for (a, b), valid in zip(pairwise(times_s), levels, strict=False) if not valid]
    assert all(0 < duration_s < 50e-6 for duration_s in resting_s)


@pytest.mark.parametrize(
    ("address", "value", "update_s"), [(DEC_RATE, 9, 30e-6), (FILT_CTRL, 2, 30e-6), (MSC_CTRL, 0x00C0, 200e-6)]
)
def test_a_setting_reads_back_only_after_its_update_time(address: int, value: int, update_s: float) -> None:
    driver = Adis16465Driver()
    before = driver.get(address)
    driver.set(address, value)
    assert driver.get(address) == before
    driver.advance(driver.time_s + update_s)
    assert driver.get(address) == value


@pytest.mark.parametrize(("address", "value"), [(DEC_RATE, 2000), (FILT_CTRL, 7)])
def test_settings_out_of_range_are_refused(address: int, value: int) -> None:
    driver = Adis16465Driver()
    driver.set(address, value)
    with pytest.raises(Violation) as caught:
        driver.advance(driver.time_s + 1e-3)
    assert caught.value.name == "sensor_setup"


def test_a_software_reset_restores_everything_and_takes_its_time() -> None:
    driver = Adis16465Driver()
    driver.set(DEC_RATE, 9)
    driver.advance(0.1)
    driver.exchange(bytes([0x80 | GLOB_CMD, 0x80]))
    assert driver.get(PROD_ID) == 0xFFFF  # silent
    driver.advance(driver.time_s + 0.3)
    assert driver.get(PROD_ID) == 0x4051
    assert driver.get(DEC_RATE) == 0


def test_before_it_is_ready_it_is_silent() -> None:
    part = Adis16465(lambda _time_s: RATE, GyroTruth(), temperature_c=25.0, seed=1, ready_s=0.31)
    part.advance(0.2)
    assert not part.interrupt_level
    part.select(0.2)
    assert [part.transfer(byte, 0.2) for byte in (PROD_ID, 0)] == [0xFF, 0xFF]
    part.deselect(0.2)
    assert part.next_event_s == pytest.approx(0.31 + 1 / 2000)
