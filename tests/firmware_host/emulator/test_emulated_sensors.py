"""The shipped image and the register-level sensors on one bus: all at once, and one of them broken."""

import numpy as np
import pytest

from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.frames import Frame, encode
from firmware_host.protocol import BATCH_AGE_US, ERRORS
from support.board.emulated_session import OTHER_PARTS, PARTS, Session, samples

pytestmark = pytest.mark.slow

NAMES = list(PARTS)
BATCH_AGE_S = BATCH_AGE_US / 1e6
RATES_HZ = {"lsm9ds1": 952.0, "mpu9250": 1000.0, "adis16465": 1000.0}


def started(rates_hz: dict[str, float]) -> Session:
    """A board whose sensors have just been told to stream."""
    session = Session(parts=[*NAMES, *OTHER_PARTS], noise_rad_s=0.0)
    session.run(0.2)  # until it has started
    for name, rate_hz in rates_hz.items():
        session.configure(name, rate_hz, 245.0)
    session.configure_magnetometer()
    session.board.receive(encode("start", 78, {"sensors": 0}))
    return session


def errors_of(frames: list[Frame]) -> list[tuple[str, str]]:
    errors = [frame.values for frame in frames if frame.name == "error"]
    return [(NAMES[values["sensor"]], ERRORS[values["code"]].name) for values in errors]


def test_all_sensors_at_their_full_rates_lose_nothing() -> None:
    """The gyroscopes, and the magnetometer beside them."""
    session = started(RATES_HZ)
    frames = session.run(1.2)
    for index, (name, rate_hz) in enumerate(RATES_HZ.items()):
        received = samples(frames, index)
        assert received["sequence"].tolist() == list(range(len(received))) and len(received) > 1.05 * rate_hz
        assert 1e6 / np.diff(received["time_us"]).mean() == pytest.approx(rate_hz, rel=1e-3), name
    fields = [frame for frame in frames if frame.name == "field_samples"]
    numbers = [frame.values["sequence"] + i for frame in fields for i in range(len(frame.items))]
    assert numbers == list(range(len(numbers))) and len(numbers) > 80
    report = session.ask("status")
    assert set(report.items["dropped"].tolist()) == {0} and report.values["bus_errors"] == 0


@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("name", "fault", "error"),
    [
        *((name, fault, "sensor_silent") for name in NAMES for fault in (Fault.ABSENT, Fault.SILENT)),
        ("adis16465", Fault.DAMAGED, "checksum_failed"),
    ],
)
def test_a_sensor_that_breaks_while_it_streams_is_named_and_costs_the_others_nothing(
    name: str, fault: Fault, error: str
) -> None:
    session = started(dict.fromkeys(NAMES, 238.0))  # of which the ICM-42688-P makes 200, the slowest of them all
    session.run(0.3)
    session.sensors[name].fault = fault
    frames = session.run(0.5)
    assert errors_of(frames) == [(name, error)]
    for index, other in enumerate(NAMES):
        if other != name:
            received = samples(frames, index)
            assert len(received) > 200.0 * (0.5 - BATCH_AGE_S) and (np.diff(received["sequence"]) == 1).all()
