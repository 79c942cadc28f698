"""What the board tells, as the rest of the program sees it: made from frames, no I/O."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from typing import Any, NamedTuple, Self

import numpy as np

from firmware_host import protocol
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.samples import FIELD_SAMPLE_DTYPE, IMU_SAMPLE_DTYPE, SAMPLE_DTYPE

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
NOTHING: Matrix = ((0.0, 0.0, 0.0),) * 3  # of what temperature changes


_DTYPES = {"imu_samples": IMU_SAMPLE_DTYPE, "field_samples": FIELD_SAMPLE_DTYPE}


class SampleBatch(NamedTuple):
    """Samples of one sensor in the order of their sequence numbers, which have no gap inside a batch.

    `dropped` is the board's latest count of conversions lost on its side since the start; `samples` is (n,) of
    `SAMPLE_DTYPE`, of `IMU_SAMPLE_DTYPE` where accelerations come along, of `FIELD_SAMPLE_DTYPE` of a magnetometer. In
    the mode "raw" their counts are the part's, in the mode "calibrated" they are microradians per second.
    """

    sensor: int
    mode: str
    dropped: int
    samples: np.ndarray

    @classmethod
    def of(cls, frames: Sequence[Frame], host_time_s: float) -> Self:
        """Frames of one kind that came at `host_time_s`, each of which goes on where the one before ended.

        They are put together as bytes and taken apart once: most of what a frame costs alone is the same for many.
        """
        first, heads = frames[0], [frame.values for frame in frames]
        items = first._replace(content=b"".join([frame.content for frame in frames])).items
        samples = np.empty(len(items), _DTYPES.get(first.name, SAMPLE_DTYPE))
        sequence = heads[0]["sequence"]
        samples["sequence"] = np.arange(sequence, sequence + len(items))
        base_times_us = np.array([head["base_time_us"] for head in heads], np.uint64)
        samples["board_time_us"] = base_times_us.repeat([head["count"] for head in heads]) + items["delta_us"]
        samples["host_time_s"] = host_time_s
        if first.name == "field_samples":
            samples["field_counts"] = items["field"]
        else:
            samples["counts"] = items["rate_urad_s" if first.name == "rates" else "counts"]
            samples["temperature_counts"] = items["temperature_counts"]
        if first.name == "imu_samples":
            samples["acceleration_counts"] = items["acceleration"]
        last = heads[-1]
        return cls(last["sensor"], protocol.MODES[last["mode"]], last["dropped"], samples)


def sample_batches(frames: Iterable[Frame], host_time_s: float) -> Iterator[SampleBatch]:
    """The batches of frames of a stream that came together at `host_time_s`, as few as there can be.

    Those of a sensor come in their order; a batch ends where samples are missing, or their kind changes.
    """
    runs: dict[int, list[Frame]] = {}
    for frame in frames:
        sensor = frame.values["sensor"]
        run = runs.get(sensor)
        if run is not None and _goes_on(run[-1], frame):
            run.append(frame)
            continue
        if run is not None:
            yield SampleBatch.of(run, host_time_s)
        runs[sensor] = [frame]
    for run in runs.values():
        yield SampleBatch.of(run, host_time_s)


def _goes_on(before: Frame, frame: Frame) -> bool:
    """Whether the samples of a sensor's frame follow those of the one before, of the same kind."""
    was, now = before.values, frame.values
    return bool(
        frame.name == before.name and now["mode"] == was["mode"] and now["sequence"] == was["sequence"] + was["count"]
    )


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """A sensor the firmware has a driver for; `present` says whether its identity register answered rightly.

    `quantity` is one of `protocol.QUANTITIES`.
    """

    index: int
    part: str
    who_am_i: int
    present: bool
    quantity: str


@dataclass(frozen=True, slots=True)
class BoardIdentity:
    """Which board this is and what it runs; `unique_id` is 24 hexadecimal digits."""

    protocol: int
    firmware: str
    unique_id: str
    reset_cause: str
    sensors: tuple[SensorInfo, ...]

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """An `identity` frame of this protocol version."""
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
    """What the heater does: its `power`, 0 to 1, the `cause` of `protocol.HEATER_CAUSES` why it is off.

    `temperature_c` is how warm the hottest part was when the board last looked.
    """

    power: float
    cause: str
    temperature_c: float

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """A `heating` frame."""
        values = frame.values
        cause = protocol.HEATER_CAUSES[values["cause"]]
        return cls(values["power"] / protocol.HEATER_POWERS, cause, values["temperature_c"])


@dataclass(frozen=True, slots=True)
class SensorSetup:
    """What the part really does: rate = counts · sensitivity_rad_s, temperature = counts · scale + offset.

    Acceleration = counts · sensitivity_m_s2, magnetic field = counts · sensitivity_t; of what is not sent, sensitivity
    and range are 0.
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
    def of(cls, frame: Frame) -> Self:
        """A `setup` frame."""
        return cls(**{field.name: frame.values[field.name] for field in fields(cls)})


@dataclass(frozen=True, slots=True)
class SensorCounts:
    """Conversions since the start, and what became of them."""

    conversions: int
    samples: int
    dropped: int


@dataclass(frozen=True, slots=True)
class BoardStatus:
    """The board's health; counts since its last reset.

    `frames_lost` counts those this program never got, `frames_repeated` those it got twice and took once.
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
    def of(cls, frame: Frame, frames_lost: int, frames_repeated: int) -> Self:
        """A `report` frame."""
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
    """An average the board took of what it had kept: of the samples from `start_us` up to, not including, `end_us`.

    The times are the board's, in microseconds; `mean_rad_s` is uncalibrated; `index` counts the sensor's observations.
    """

    index: int
    start_us: int
    end_us: int
    samples: int
    mean_rad_s: Vector

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """An `observed` frame."""
        return cls(**{field.name: frame.values[field.name] for field in fields(cls)})


@dataclass(frozen=True, slots=True)
class BoardSolution:
    """What the board solved for, g = K (m + b), in single precision; unless `status` is "solved", scale and bias are 0.

    `method` is one of `protocol.METHODS`, `status` of `protocol.SOLUTION_STATUSES`.
    """

    method: str
    status: str
    observations: int
    iterations: int
    scale: Vector
    bias_rad_s: Vector

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """A `solution` frame."""
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
    """What a temperature of the part's own thermometer changes, inside `range_c` and at its ends beyond it.

    Row n − 1 of each belongs to (T − `temperature_c`)ⁿ, n from 1 to 3, and has an axis in each column: what is added to
    1 and multiplies m + b, and what is added to b.
    """

    range_c: tuple[float, float]
    scale_change: Matrix
    bias_change_rad_s: Matrix

    def most(self) -> tuple[np.ndarray, np.ndarray]:
        """(3,) the most that scale, as a share, and bias can change by axis, from anywhere in the range."""
        powers = (self.range_c[1] - self.range_c[0]) ** np.arange(1, 4)
        return powers @ np.abs(self.scale_change), powers @ np.abs(self.bias_change_rad_s)


@dataclass(frozen=True, slots=True)
class Calibration:
    """A calibration as the board keeps it: rate = `matrix` (m + `bias_rad_s`).

    `model` is one of `protocol.MODELS`, `serial_number` the sensor's, `temperature_c` its own during the calibration.
    `polynomials` are there of one over temperature: matrix and bias hold at `temperature_c` then.
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
        """Each axis' scale factor k: F⁻¹ being the matrix, up to a rotation, 1/‖row i of F‖."""
        if self.model == protocol.MODELS[1]:
            return self.matrix[0][0], self.matrix[1][1], self.matrix[2][2]
        kx, ky, kz = (1 / np.linalg.norm(np.linalg.inv(self.matrix), axis=1)).tolist()
        return kx, ky, kz

    @classmethod
    def of(cls, values: dict[str, Any]) -> Self:
        """The fields `protocol.CALIBRATION` of a frame."""
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
        """The stored calibration as the fields of its message."""
        found = self.polynomials or StoredPolynomials((self.temperature_c,) * 2, NOTHING, NOTHING)
        return {
            "model": protocol.MODELS.index(self.model),
            "serial_number": self.serial_number,
            "written_unix_s": int(self.written_utc.timestamp()),
            "temperature_c": self.temperature_c,
            "matrix": self.matrix,
            "bias_rad_s": self.bias_rad_s,
            "lowest_c": found.range_c[0],
            "highest_c": found.range_c[1],
            "scale_change": found.scale_change,
            "bias_change_rad_s": found.bias_change_rad_s,
        }

    def as_kept(self) -> Self:
        """The stored calibration as it comes back from the board: single precision, whole seconds."""
        (frame,) = FrameReader().feed(encode("write_calibration", 1, {"sensor": 0, **self.values()}))
        return self.of(frame.values)


@dataclass(frozen=True, slots=True)
class StoredCalibration:
    """A calibration in the board's flash, and which part it was stored for, at which range.

    `sequence` counts the calibrations ever stored for the sensor, from 1.
    """

    sequence: int
    part: str
    who_am_i: int
    range_deg_s: float
    calibration: Calibration

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """A `calibration` frame."""
        values = frame.values
        return cls(
            sequence=values["sequence"],
            part=protocol.text(values["part"]),
            who_am_i=values["who_am_i"],
            range_deg_s=values["range_deg_s"],
            calibration=Calibration.of(values),
        )

    def document(self) -> dict[str, Any]:
        """The record as plain numbers, strings and lists."""
        calibration, found = self.calibration, self.calibration.polynomials
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
            "over_temperature": None if found is None else asdict(found),
        }


def reset_cause(frame: Frame) -> str:
    """Why the board last started, of an `identity` or `report` frame."""
    causes = dict(enumerate(protocol.RESET_CAUSES))
    return causes.get(frame.values.get("reset_cause", 0), "unknown")  # another version's identity may lack it
