"""The board's answers as values for the rest of the program, decoded from frames. No I/O."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from itertools import accumulate
from typing import Any, NamedTuple, Self

import numpy as np

from firmware_host import protocol
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.samples import FIELD_SAMPLE_DTYPE, IMU_SAMPLE_DTYPE, SAMPLE_DTYPE

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
NO_CHANGE: Matrix = ((0.0, 0.0, 0.0),) * 3  # of scale or bias with temperature


_DTYPES = {"imu_samples": IMU_SAMPLE_DTYPE, "field_samples": FIELD_SAMPLE_DTYPE}


class SampleBatch(NamedTuple):
    """Samples of one sensor in the order of their sequence numbers, which have no gap inside a batch.

    `dropped` is the board's latest count of conversions that it has lost since the start. `samples` (n,) has the dtype
    `IMU_SAMPLE_DTYPE` with accelerations, `FIELD_SAMPLE_DTYPE` for a magnetometer, else `SAMPLE_DTYPE`. A count is the
    part's own in the mode "raw", and a microradian per second in the mode "calibrated".
    """

    sensor: int
    mode: str
    dropped: int
    samples: np.ndarray


def sample_batches(frames: Iterable[Frame], host_time_s: float) -> Iterator[SampleBatch]:
    """Yield the samples of frames that came together at `host_time_s`, in as few batches as possible.

    Batches of a sensor are in order; a new one begins after missing samples, and if the samples' kind changes.
    """
    runs = _runs(frames)
    samples = {name: _samples(name, runs, host_time_s) for name in {run[0].name for run in runs}}
    position = dict.fromkeys(samples, 0)
    for run in runs:
        name, first, last = run[0].name, run[0].values, run[-1].values
        start = position[name]
        position[name] += last["sequence"] + last["count"] - first["sequence"]
        mode = protocol.MODES[last["mode"]]
        yield SampleBatch(last["sensor"], mode, last["dropped"], samples[name][start : position[name]])


def _runs(frames: Iterable[Frame]) -> list[list[Frame]]:
    """Return the frames of each sensor, divided into runs of consecutive ones, in order."""
    runs, latest = list[list[Frame]](), dict[int, list[Frame]]()
    for frame in frames:
        sensor = frame.values["sensor"]
        run = latest.get(sensor)
        if run is not None and _continues(run[-1], frame):
            run.append(frame)
        else:
            latest[sensor] = run = [frame]
            runs.append(run)
    return runs


def _samples(name: str, runs: Sequence[Sequence[Frame]], host_time_s: float) -> np.ndarray:
    """Return the samples (n,) of all frames of one name, run after run.

    The bytes of all frames are joined and decoded at once, so that the frames share most of the cost.
    """
    frames = [frame for run in runs if run[0].name == name for frame in run]
    items = np.frombuffer(b"".join([frame.content for frame in frames]), protocol.MESSAGE_BY_NAME[name].item_dtype)
    heads = [frame.values for frame in frames]
    counts = [head["count"] for head in heads]
    base_times_us = np.array([head["base_time_us"] for head in heads], np.uint64)
    before = accumulate(counts, initial=0)  # items of the frames before
    less = np.array([head["sequence"] - items_before for head, items_before in zip(heads, before, strict=False)])
    samples = np.empty(len(items), _DTYPES.get(name, SAMPLE_DTYPE))
    samples["sequence"] = less.repeat(counts) + np.arange(len(items))
    samples["board_time_us"] = base_times_us.repeat(counts) + items["delta_us"]
    samples["host_time_s"] = host_time_s
    if name == "field_samples":
        samples["field_counts"] = items["field"]
    else:
        samples["counts"] = items["rate_urad_s" if name == "rates" else "counts"]
        samples["temperature_counts"] = items["temperature_counts"]
    if name == "imu_samples":
        samples["acceleration_counts"] = items["acceleration"]
    return samples


def _continues(before: Frame, frame: Frame) -> bool:
    """Return whether the samples of `frame` follow those of `before` without a gap and are of the same kind."""
    previous, current = before.values, frame.values
    return bool(
        frame.name == before.name
        and current["mode"] == previous["mode"]
        and current["sequence"] == previous["sequence"] + previous["count"]
    )


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """A sensor with a driver in the firmware; `present` says whether its identity register reads as expected.

    `quantity` is one of `protocol.QUANTITIES`.
    """

    index: int
    part: str
    who_am_i: int
    present: bool
    quantity: str


@dataclass(frozen=True, slots=True)
class BoardIdentity:
    """The board's identity and its firmware; `unique_id` is 24 hexadecimal digits."""

    protocol: int
    firmware: str
    unique_id: str
    reset_cause: str
    sensors: tuple[SensorInfo, ...]

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode an `identity` frame of this protocol version."""
        return cls(
            protocol=frame.values["protocol"],
            firmware=protocol.text(frame.values["firmware"]),
            unique_id=frame.values["unique_id"].hex(),
            reset_cause=reset_cause(frame),
            sensors=tuple(
                SensorInfo(index, protocol.text(part), who_am_i, bool(present), protocol.QUANTITIES[quantity])
                for index, (part, who_am_i, present, quantity) in enumerate(frame.items.tolist())
            ),
        )


@dataclass(frozen=True, slots=True)
class Heating:
    """The heater's state: its `power`, 0 to 1, and why it is off, the `cause` from `protocol.HEATER_CAUSES`.

    `temperature_c` is the temperature of the hottest part at the board's last check.
    """

    power: float
    cause: str
    temperature_c: float

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `heating` frame."""
        values = frame.values
        cause = protocol.HEATER_CAUSES[values["cause"]]
        return cls(values["power"] / protocol.HEATER_POWERS, cause, values["temperature_c"])


@dataclass(frozen=True, slots=True)
class SensorSetup:
    """The part's actual settings; sensitivity and range are 0 for quantities that are not sent.

    - `rate_hz`: the nominal data rate.
    - `range_deg_s`, `sensitivity_rad_s`: of rates; rate = counts · sensitivity_rad_s.
    - `temperature_scale_c`, `temperature_offset_c`: temperature = counts · scale + offset.
    - `range_m_s2`, `sensitivity_m_s2`: of accelerations; acceleration = counts · sensitivity_m_s2.
    - `range_t`, `sensitivity_t`: of the magnetic field; field = counts · sensitivity_t.
    """

    rate_hz: float
    range_deg_s: float
    sensitivity_rad_s: float
    temperature_scale_c: float
    temperature_offset_c: float
    range_m_s2: float
    sensitivity_m_s2: float
    range_t: float
    sensitivity_t: float

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `setup` frame."""
        return cls(**{field.name: frame.values[field.name] for field in fields(cls)})


@dataclass(frozen=True, slots=True)
class SensorCounts:
    """The numbers of conversions since the start, of samples sent in frames, and of samples dropped."""

    conversions: int
    samples: int
    dropped: int


@dataclass(frozen=True, slots=True)
class BoardStatus:
    """The board's health; counts since its last reset.

    - `frames_lost`, `frames_repeated`: frames that this program never received, and those received twice.
    - `uptime_s`: board time.
    - `rx_errors`, `tx_overruns`: damaged frames from the host, and frames not sent for lack of room.
    - `bus_errors`: failed reads of sensors.
    - `stack_high_water_bytes`: the most stack ever used.
    - `fault_pc`, `reset_cause`: the address of the last processor fault, and the cause of the last start.
    - `clock_locked`, `streaming`: whether the clock follows the crystal, and whether the board streams.
    - `sensors`: the counts of conversions by sensor.
    """

    frames_lost: int
    frames_repeated: int
    uptime_s: float
    rx_errors: int
    tx_overruns: int
    bus_errors: int
    stack_high_water_bytes: int
    fault_pc: int
    reset_cause: str
    clock_locked: bool
    streaming: bool
    sensors: tuple[SensorCounts, ...]

    @classmethod
    def decode(cls, frame: Frame, frames_lost: int, frames_repeated: int) -> Self:
        """Decode a `report` frame."""
        values = frame.values
        return cls(
            frames_lost=frames_lost,
            frames_repeated=frames_repeated,
            uptime_s=values["uptime_us"] * 1e-6,
            rx_errors=values["rx_errors"],
            tx_overruns=values["tx_overruns"],
            bus_errors=values["bus_errors"],
            stack_high_water_bytes=values["stack_high_water"],
            fault_pc=values["fault_pc"],
            reset_cause=reset_cause(frame),
            clock_locked=bool(values["clock_locked"]),
            streaming=bool(values["streaming"]),
            sensors=tuple(SensorCounts(*item) for item in frame.items.tolist()),
        )


@dataclass(frozen=True, slots=True)
class BoardObservation:
    """The board's average of a sensor's stored readings, from `start_us` up to, not including, `end_us`.

    The times are the board's, in microseconds. `mean_rad_s` is not calibrated, and `index` is the number of the
    sensor's earlier observations.
    """

    index: int
    start_us: int
    end_us: int
    samples: int
    mean_rad_s: Vector

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode an `observed` frame."""
        return cls(**{field.name: frame.values[field.name] for field in fields(cls)})


@dataclass(frozen=True, slots=True)
class BoardSolution:
    """The board's solution of g = K (m + b), rate g and reading m, in single precision.

    `method` is one of `protocol.METHODS`, and `status` one of `protocol.SOLUTION_STATUSES`; `scale` (the diagonal of K)
    and `bias_rad_s` (b) are 0 unless `status` is "solved".
    """

    method: str
    status: str
    observations: int
    iterations: int
    scale: Vector
    bias_rad_s: Vector

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `solution` frame."""
        values = frame.values
        return cls(
            method=protocol.METHODS[values["method"]],
            status=protocol.SOLUTION_STATUSES[values["status"]],
            observations=values["observations"],
            iterations=values["iterations"],
            scale=values["scale"],
            bias_rad_s=values["bias_rad_s"],
        )


@dataclass(frozen=True, slots=True)
class StoredPolynomials:
    """The changes of scale and bias with the part's own temperature T in `range_c`; outside they stay constant.

    Row n − 1 of each matrix (3, 3) has, for each axis, the coefficient of (T − `Calibration.temperature_c`)ⁿ, n = 1, 2,
    3. The change of the bias is added to b; the sum m + b with the reading m is then multiplied by 1 plus the change of
    the scale.
    """

    range_c: tuple[float, float]
    scale_change: Matrix
    bias_change_rad_s: Matrix

    def most(self) -> tuple[np.ndarray, np.ndarray]:
        """Return upper bounds of the scale's change (3,), as a fraction, and the bias' change (3,), rad/s, in range."""
        powers = (self.range_c[1] - self.range_c[0]) ** np.arange(1, 4)
        return powers @ np.abs(self.scale_change), powers @ np.abs(self.bias_change_rad_s)


@dataclass(frozen=True, slots=True)
class Calibration:
    """A calibration as stored by the board: rate = `matrix` (m + `bias_rad_s`), m the reading.

    `model` is one of `protocol.MODELS`; the sensor has the `serial_number`, and had `temperature_c` when calibrated. A
    calibration over temperature has `polynomials`; its matrix and bias are valid at `temperature_c`.
    """

    model: str
    serial_number: str
    written_utc: datetime
    temperature_c: float
    matrix: Matrix
    bias_rad_s: Vector
    polynomials: StoredPolynomials | None = None

    @property
    def scale(self) -> Vector:
        """The scale factors by axis, 1/‖row i of `matrix`⁻¹‖, which a rotation of the corrected frame preserves."""
        if self.model == protocol.MODELS[1]:
            return self.matrix[0][0], self.matrix[1][1], self.matrix[2][2]
        kx, ky, kz = (1 / np.linalg.norm(np.linalg.inv(self.matrix), axis=1)).tolist()
        return kx, ky, kz

    @classmethod
    def decode(cls, values: dict[str, Any]) -> Self:
        """Decode the fields `protocol.CALIBRATION` of a frame."""
        return cls(
            model=dict(enumerate(protocol.MODELS)).get(values["model"], "unknown"),
            serial_number=protocol.text(values["serial_number"]),
            written_utc=datetime.fromtimestamp(values["written_unix_s"], UTC),
            temperature_c=values["temperature_c"],
            matrix=values["matrix"],
            bias_rad_s=values["bias_rad_s"],
            polynomials=StoredPolynomials(
                (values["lowest_c"], values["highest_c"]), values["scale_change"], values["bias_change_rad_s"]
            )
            if values["lowest_c"] < values["highest_c"]
            else None,
        )

    def values(self) -> dict[str, Any]:
        """Return the calibration as the fields of its message."""
        polynomials = self.polynomials or StoredPolynomials((self.temperature_c,) * 2, NO_CHANGE, NO_CHANGE)
        return {
            "model": protocol.MODELS.index(self.model),
            "serial_number": self.serial_number,
            "written_unix_s": int(self.written_utc.timestamp()),
            "temperature_c": self.temperature_c,
            "matrix": self.matrix,
            "bias_rad_s": self.bias_rad_s,
            "lowest_c": polynomials.range_c[0],
            "highest_c": polynomials.range_c[1],
            "scale_change": polynomials.scale_change,
            "bias_change_rad_s": polynomials.bias_change_rad_s,
        }

    def quantize(self) -> Self:
        """Return the calibration as the board returns it: in single precision and whole seconds."""
        (frame,) = FrameReader().feed(encode("write_calibration", 1, {"sensor": 0, **self.values()}))
        return self.decode(frame.values)


@dataclass(frozen=True, slots=True)
class StoredCalibration:
    """A calibration in the board's flash, with the part and the range it was stored for.

    `sequence`: the number of calibrations ever stored for the sensor, including this one.
    """

    sequence: int
    part: str
    who_am_i: int
    range_deg_s: float
    calibration: Calibration

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `calibration` frame."""
        values = frame.values
        return cls(
            sequence=values["sequence"],
            part=protocol.text(values["part"]),
            who_am_i=values["who_am_i"],
            range_deg_s=values["range_deg_s"],
            calibration=Calibration.decode(values),
        )

    def document(self) -> dict[str, Any]:
        """Return the record as plain numbers, strings and lists."""
        calibration, polynomials = self.calibration, self.calibration.polynomials
        return {
            "sequence": self.sequence,
            "part": self.part,
            "who_am_i": self.who_am_i,
            "range_deg_s": self.range_deg_s,
            "model": calibration.model,
            "serial_number": calibration.serial_number,
            "written_utc": calibration.written_utc.isoformat(timespec="seconds"),
            "temperature_c": calibration.temperature_c,
            "scale": list(calibration.scale),
            "matrix": [list(row) for row in calibration.matrix],
            "bias_rad_s": list(calibration.bias_rad_s),
            "over_temperature": None if polynomials is None else asdict(polynomials),
        }


def reset_cause(frame: Frame) -> str:
    """Return the cause of the board's last start from an `identity` or `report` frame."""
    causes = dict(enumerate(protocol.RESET_CAUSES))
    return causes.get(frame.values.get("reset_cause", 0), "unknown")  # another version's identity may lack it
