"""The simulated LSM9DS1 at its registers, against the datasheet and against the truth it is given."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_host.emulator.bus import Violation
from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.lsm9ds1 import Lsm9ds1

INT1_CTRL, WHO_AM_I, CTRL_REG1_G, CTRL_REG8 = 0x0C, 0x0F, 0x10, 0x22
OUT_TEMP, STATUS, OUT_G = 0x15, 0x17, 0x18
BDU, IF_ADD_INC, SW_RESET = 0x40, 0x04, 0x01
RANGE_CODES = {245.0: 0, 500.0: 1, 2000.0: 3}
SENSITIVITIES_MDPS = {245.0: 8.75, 500.0: 17.5, 2000.0: 70.0}
RATES_HZ = {1: 14.9, 2: 59.5, 3: 119.0, 4: 238.0, 5: 476.0, 6: 952.0}

Rate = Callable[[float], Sequence[float]]


def still(_time_s: float) -> Sequence[float]:
    return (0.0, 0.0, 0.0)


class Bus:
    """Plays the SPI master on one part."""

    def __init__(
        self, rate_at: Rate = still, truth: GyroTruth | None = None, *, temperature_c: float = 25.0, seed: int = 1
    ) -> None:
        self.part = Lsm9ds1(rate_at, truth or GyroTruth(), temperature_c=temperature_c, seed=seed)
        self.time_s = 0.0

    def read(self, address: int, count: int = 1) -> bytes:
        self.part.select(self.time_s)
        self.part.transfer(0x80 | address, self.time_s)
        data = bytes(self.part.transfer(0, self.time_s) for _ in range(count))
        self.part.deselect(self.time_s)
        return data

    def write(self, address: int, value: int) -> None:
        self.part.select(self.time_s)
        self.part.transfer(address, self.time_s)
        self.part.transfer(value, self.time_s)
        self.part.deselect(self.time_s)

    def advance(self, time_s: float) -> None:
        self.part.advance(time_s)
        self.time_s = time_s

    def start(self, rate_code: int = 4, range_deg_s: float = 245.0) -> None:
        self.write(CTRL_REG1_G, rate_code << 5 | RANGE_CODES[range_deg_s] << 3)

    def settle(self) -> None:
        """Let the conversions pass that the datasheet says to discard; 8 at most."""
        self.counts(8)

    def next_counts(self) -> np.ndarray:
        """The next conversion. Returns (3,) counts."""
        self.advance(self.part.next_event_s)
        return np.frombuffer(self.read(OUT_G, 6), "<i2")

    def counts(self, conversions: int) -> np.ndarray:
        """Shape (conversions, 3)."""
        return np.array([self.next_counts() for _ in range(conversions)])


def test_identity() -> None:
    assert Bus().read(WHO_AM_I) == b"\x68"


def test_powered_down_it_does_nothing() -> None:
    bus = Bus()
    assert bus.part.next_event_s == math.inf
    bus.advance(10.0)
    assert bus.read(STATUS) == b"\0"
    assert not bus.part.interrupt_level


@pytest.mark.parametrize(("code", "rate_hz"), RATES_HZ.items())
def test_conversions_come_at_the_data_rate(code: int, rate_hz: float) -> None:
    asked: list[float] = []

    def rate_at(time_s: float) -> Sequence[float]:
        asked.append(time_s)
        return (0.0, 0.0, 0.0)

    bus = Bus(rate_at)
    bus.advance(0.25)
    bus.start(code)
    bus.advance(1.25)
    assert asked == pytest.approx(0.25 + np.arange(1, len(asked) + 1) / rate_hz, abs=1e-12)
    assert len(asked) == math.floor(rate_hz)


def test_its_own_oscillator_sets_the_pace() -> None:
    part = Lsm9ds1(still, GyroTruth(), temperature_c=25.0, seed=1, oscillator_ppm=10_000.0)
    part.select(0.0)
    part.transfer(CTRL_REG1_G, 0.0)
    part.transfer(4 << 5, 0.0)
    assert part.next_event_s == pytest.approx(1 / (238 * 1.01))


@pytest.mark.parametrize("range_deg_s", RANGE_CODES)
def test_sensitivity_is_the_datasheet_s(range_deg_s: float) -> None:
    rate = np.radians(range_deg_s) * np.array([0.9, -0.5, 0.1])
    bus = Bus(lambda _time_s: rate)
    bus.start(range_deg_s=range_deg_s)
    bus.settle()
    expected = rate / np.radians(SENSITIVITIES_MDPS[range_deg_s] * 1e-3)
    assert np.all(np.abs(bus.next_counts() - expected) <= 0.5)


def test_too_much_saturates() -> None:
    bus = Bus(lambda _time_s: (10.0, -10.0, np.radians(286.0)))
    bus.start()
    bus.settle()
    assert bus.next_counts().tolist() == [32767, -32768, round(286 / 8.75e-3)]


def test_small_rates_are_quantised() -> None:
    per_count = math.radians(8.75e-3)
    bus = Bus(lambda time_s: (0.6 * per_count, 0.4 * per_count, -1.6 * per_count))
    bus.start()
    bus.settle()
    assert bus.next_counts().tolist() == [1, 0, -2]


@pytest.mark.parametrize(("code", "discard"), [(1, 2), (2, 3), (3, 3), (4, 4), (5, 5), (6, 8)])
def test_the_first_conversions_after_a_start_are_wrong(code: int, discard: int) -> None:
    bus = Bus(lambda _time_s: (1.0, 1.0, 1.0))
    bus.start(code)
    right = bus.counts(20)[:, 0] == round(math.degrees(1.0) / 8.75e-3)
    assert right.tolist() == [False] * discard + [True] * (20 - discard)


vectors = st.tuples(*[st.floats(-3, 3)] * 3)


@settings(max_examples=50)
@given(vectors, st.tuples(*[st.floats(0.7, 1.3)] * 3), st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_the_truth_is_g_equals_k_times_m_plus_b(
    rate: tuple[float, ...], scale: tuple[float, ...], bias_rad_s: tuple[float, ...]
) -> None:
    bus = Bus(lambda _time_s: rate, GyroTruth(scale, bias_rad_s))
    bus.start(range_deg_s=500.0)
    bus.settle()
    per_count = math.radians(17.5e-3)
    recovered = np.array(scale) * (bus.next_counts() * per_count + np.array(bias_rad_s))
    assert np.all(np.abs(recovered - rate) <= 0.5001 * per_count * np.array(scale))


def test_non_orthogonal_axes_pick_up_their_neighbours() -> None:
    xy, xz, yz = 0.02, -0.01, 0.03
    columns = []
    for axis in np.eye(3):
        bus = Bus(lambda _time_s, axis=axis: axis, GyroTruth(non_orthogonality_rad=(xy, xz, yz)))  # type: ignore[misc]
        bus.start()
        bus.settle()
        columns.append(bus.next_counts() * math.radians(8.75e-3))
    axes = np.array(columns).T
    assert np.linalg.norm(axes, axis=1) == pytest.approx(1.0, abs=3e-4)
    assert axes @ [1, 0, 0] == pytest.approx([1, math.sin(xy), math.sin(xz)], abs=1e-4)
    assert axes @ [0, 1, 0] == pytest.approx([0, math.cos(xy), math.sin(yz)], abs=1e-4)


def test_noise_is_white_and_as_strong_as_told() -> None:
    noise_rad_s, count = 0.035, 4000
    bus = Bus(truth=GyroTruth(noise_rad_s=noise_rad_s), seed=3)
    bus.start()
    readings = bus.counts(count) * math.radians(8.75e-3)
    assert np.all(np.abs(readings.mean(axis=0)) < 4 * noise_rad_s / math.sqrt(count))
    assert readings.std(axis=0) == pytest.approx(noise_rad_s, rel=4 / math.sqrt(2 * count))
    correlations = np.corrcoef(np.column_stack([readings[1:], readings[:-1]]).T)
    assert np.all(np.abs(correlations - np.eye(6)) < 4.5 / math.sqrt(count))


def test_noise_follows_the_seed_and_not_the_reader() -> None:
    truth = GyroTruth(noise_rad_s=0.035)
    eager, lazy, other = Bus(truth=truth, seed=3), Bus(truth=truth, seed=3), Bus(truth=truth, seed=4)
    for bus in (eager, lazy, other):
        bus.start()
    eager_counts = eager.counts(500)
    lazy.advance(499.5 / 238)  # nobody reads the first 499
    assert lazy.next_counts().tolist() == eager_counts[-1].tolist()
    assert not np.array_equal(other.counts(500), eager_counts)


@pytest.mark.parametrize(("temperature_c", "counts"), [(25.0, 0), (22.0, -48), (85.0, 960), (-40.0, -1040)])
def test_temperature(temperature_c: float, counts: int) -> None:
    bus = Bus(temperature_c=temperature_c)
    bus.start()
    bus.advance(0.01)
    assert int.from_bytes(bus.read(OUT_TEMP, 2), "little", signed=True) == counts


def test_data_ready_lasts_until_the_last_byte_is_read() -> None:
    bus = Bus()
    bus.write(INT1_CTRL, 0x02)
    bus.start()
    bus.advance(0.9 / 238)
    assert not bus.part.interrupt_level
    bus.advance(1.1 / 238)
    assert bus.part.interrupt_level
    assert bus.read(STATUS)[0] & 0x02
    bus.read(OUT_G, 5)
    assert bus.part.interrupt_level
    bus.read(OUT_G + 5)
    assert not bus.part.interrupt_level
    assert not bus.read(STATUS)[0] & 0x02
    bus.advance(2.1 / 238)
    assert bus.part.interrupt_level


def test_the_pin_stays_low_unless_routed() -> None:
    bus = Bus()
    bus.start()
    bus.advance(0.1)
    assert bus.read(STATUS)[0] & 0x02
    assert not bus.part.interrupt_level


def ramp(time_s: float) -> Sequence[float]:
    """256 counts a conversion at 245 °/s and 238 Hz, from -1 count: every conversion changes both bytes."""
    counts = round(time_s * 238) * 0x101 - 1
    return (counts * math.radians(8.75e-3),) * 3


def test_an_unread_conversion_is_replaced_by_the_next() -> None:
    bus = Bus(ramp)
    bus.start()
    bus.advance(5.5 / 238)
    assert np.frombuffer(bus.read(OUT_G, 6), "<i2").tolist() == [5 * 0x101 - 1] * 3


@pytest.mark.parametrize(("control", "torn"), [(IF_ADD_INC | BDU, False), (IF_ADD_INC, True)])
def test_block_data_update_keeps_both_bytes_of_one_conversion(control: int, torn: bool) -> None:
    bus = Bus(ramp)
    bus.write(CTRL_REG8, control)
    bus.start()
    bus.settle()
    bus.advance(9.5 / 238)
    low = bus.read(OUT_G)
    bus.advance(10.5 / 238)
    high = bus.read(OUT_G + 1)
    first, second = 9 * 0x101 - 1, 10 * 0x101 - 1
    value = int.from_bytes(low + high, "little")
    assert value == ((second & 0xFF00 | first & 0xFF) if torn else first)
    assert np.frombuffer(bus.read(OUT_G, 6), "<i2").tolist() == [second] * 3


def test_without_address_increment_the_same_register_answers() -> None:
    bus = Bus()
    assert bus.read(WHO_AM_I, 2) == b"\x68\x00"
    bus.write(CTRL_REG8, 0)
    assert bus.read(WHO_AM_I, 3) == b"\x68\x68\x68"


def test_software_reset_restores_every_register() -> None:
    bus = Bus()
    bus.write(INT1_CTRL, 0x02)
    bus.start()
    bus.advance(0.1)
    bus.write(CTRL_REG8, SW_RESET)
    assert bus.read(CTRL_REG8) == bytes([IF_ADD_INC])
    assert bus.read(INT1_CTRL) + bus.read(CTRL_REG1_G) + bus.read(STATUS) == bytes(3)
    assert bus.part.next_event_s == math.inf


@pytest.mark.parametrize(
    ("address", "value", "name"),
    [
        (0x12, 0x40, "unmodelled_bits"),  # high-pass filter
        (0x20, 0x60, "unmodelled_bits"),  # accelerometer on
        (0x05, 0x01, "unmodelled_register"),
        (CTRL_REG1_G, 0x90, "sensor_setup"),  # range code 2
        (CTRL_REG1_G, 0xE0, "sensor_setup"),  # rate code 7
    ],
)
def test_what_has_no_model_is_refused(address: int, value: int, name: str) -> None:
    with pytest.raises(Violation) as caught:
        Bus().write(address, value)
    assert caught.value.name == name
    assert "LSM9DS1" in caught.value.what


def test_registers_without_a_model_cannot_be_read() -> None:
    with pytest.raises(Violation, match="0x28"):
        Bus().read(0x28)
