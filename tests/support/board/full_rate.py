"""A session of sensors that stream from the emulated board, with an account of every conversion."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from firmware_host.answers import NO_CHANGE
from firmware_host.frames import Frame, encode
from support.board.emulated_session import PARTS, Session

# name → each part's rate, and which are calibrated
_USUAL = {"lsm9ds1": 238.0, "mpu9250": 200.0, "adis16465": 200.0}
_FASTEST = {"lsm9ds1": 952.0, "mpu9250": 1000.0, "adis16465": 2000.0}
CASES: dict[str, tuple[dict[str, float], tuple[str, ...]]] = {
    "three sensors": (_USUAL, ()),
    "one at 952 Hz": ({"lsm9ds1": 952.0}, ()),
    "all at their highest rates": (_FASTEST, ()),
    "all at their highest rates, calibrated": (_FASTEST, tuple(_FASTEST)),
}
SLICE_S = 1.0  # simulated time between two reads
CALIBRATION = {
    "model": 2,
    "serial_number": "simulated",
    "written_unix_s": 1_790_000_000,
    "temperature_c": 22.0,
    "matrix": ((1.1771, -0.0030, 0.0020), (-0.0031, 1.1554, -0.0025), (0.0021, -0.0026, 1.1440)),
    "bias_rad_s": (0.0077, -0.0100, -0.0051),
    "lowest_c": 22.0,
    "highest_c": 22.0,
    "scale_change": NO_CHANGE,
    "bias_change_rad_s": NO_CHANGE,
}
STARTING = 80  # conversions that may be no samples: those a part makes while it settles
STOPPING = 5  # samples that may come from later conversions than the request to stop


@dataclass(slots=True)
class Account:
    """One sensor's samples. `readings`: conversions of the simulated part from the start to the request to stop."""

    rate_hz: float
    samples: int = 0
    lost: int = 0  # numbers missing in the sequence
    late: int = 0  # steps of time between consecutive samples that are not one period
    dropped: int = 0  # by the board's own count
    readings: int = 0
    _last_us: int | None = None

    def take(self, frame: Frame) -> None:
        """Count a frame of this sensor's samples."""
        values = frame.values
        self.lost += values["sequence"] - (self.samples + self.lost)
        self.samples += values["count"]
        self.dropped = values["dropped"]
        period_us = 1e6 / self.rate_hz
        for delta_us in frame.items["delta_us"].tolist():
            time_us = values["base_time_us"] + delta_us
            if self._last_us is not None and abs(time_us - self._last_us - period_us) > 0.1 * period_us:
                self.late += 1
            self._last_us = time_us

    @property
    def complaint(self) -> str | None:
        """A description of missing or irregular samples, or None."""
        if self.lost or self.late or self.dropped:
            return f"{self.lost} lost, {self.dropped} dropped by the board, {self.late} irregular time stamps"
        if not -STOPPING <= self.readings - self.samples <= STARTING:
            return f"{self.readings} conversions, {self.samples} samples"
        return None


@dataclass(frozen=True, slots=True)
class Stream:
    """The results of a stream: each part's account, and losses on the link as counted by the board and the reader."""

    accounts: dict[str, Account]
    bytes_sent: int
    frames_lost: int
    tx_overruns: int
    bus_errors: int

    @property
    def complaints(self) -> list[str]:
        """Descriptions of all defects."""
        texts = [f"{part}: {account.complaint}" for part, account in self.accounts.items() if account.complaint]
        if self.frames_lost or self.tx_overruns or self.bus_errors:
            texts.append(
                f"{self.frames_lost} frames lost, {self.tx_overruns} without room, {self.bus_errors} failed reads"
            )
        return texts


def stream(
    rates_hz: Mapping[str, float], duration_s: float, calibrated: Collection[str] = (), range_g: float = 0.0
) -> Stream:
    """Stream the named parts at these rates for `duration_s` of simulated time.

    Those in `calibrated` are calibrated, all others send accelerations unless `range_g` is 0.
    """
    session = Session(parts=list(rates_hz))
    session.run(0.2)
    names = list(PARTS)
    accounts = {}
    for part, rate_hz in rates_hz.items():
        accounts[part] = Account(session.configure(part, rate_hz, range_g=range_g).values["rate_hz"])
        if part in calibrated:
            assert session.ask("write_calibration", sensor=names.index(part), **CALIBRATION).name == "ack"
    before, readings = len(session.sent), dict(session.readings)
    session.board.receive(encode("start", 78, {"sensors": sum(1 << names.index(part) for part in calibrated)}))
    for _ in range(round(duration_s / SLICE_S)):
        _take(accounts, session.run(SLICE_S))
    session.board.receive(encode("stop", 79))
    for part, account in accounts.items():
        account.readings = session.readings[part] - readings[part]
    _take(accounts, session.run(0.2))
    bytes_sent = len(session.sent) - before
    report = session.ask("status").values
    return Stream(accounts, bytes_sent, session.reader.lost, report["tx_overruns"], report["bus_errors"])


def _take(accounts: Mapping[str, Account], frames: Iterable[Frame]) -> None:
    names = list(PARTS)
    for frame in frames:
        if frame.name in ("samples", "imu_samples", "rates"):
            accounts[names[frame.values["sensor"]]].take(frame)
        else:
            assert frame.name in ("ack", "identity"), frame
