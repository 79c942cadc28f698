"""What the board tells, as the rest of the program sees it: made from frames, no I/O."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from firmware_host import protocol
from firmware_host.protocol import Frame
from firmware_host.samples import SAMPLE_DTYPE


@dataclass(frozen=True, slots=True)
class SampleBatch:
    """Samples of one sensor in the order of their sequence numbers, which have no gap inside a batch.

    `dropped` is the board's count of conversions lost on its side since the start; `samples` is (n,) of `SAMPLE_DTYPE`.
    """

    sensor: int
    mode: str
    dropped: int
    samples: np.ndarray

    @classmethod
    def of(cls, frame: Frame, host_time_s: float) -> Self:
        """A `samples` frame that came at `host_time_s`."""
        values, items = frame.values, frame.items
        samples = np.empty(len(items), SAMPLE_DTYPE)
        samples["sequence"] = values["sequence"] + np.arange(len(items), dtype=np.uint32)
        samples["board_time_us"] = values["base_time_us"] + items["delta_us"].astype(np.uint64)
        samples["host_time_s"] = host_time_s
        samples["counts"] = items["counts"]
        samples["temperature_counts"] = items["temperature_counts"]
        return cls(values["sensor"], protocol.MODES[values["mode"]], values["dropped"], samples)


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """A sensor the firmware has a driver for; `present` says whether its identity register answered rightly."""

    index: int
    part: str
    who_am_i: int
    present: bool


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
                SensorInfo(index, protocol.text(part), who_am_i, bool(present))
                for index, (part, who_am_i, present) in enumerate(frame.items.tolist())
            ),
        )


@dataclass(frozen=True, slots=True)
class SensorSetup:
    """What the part really does: rate = counts · sensitivity_rad_s, temperature = counts · scale + offset."""

    rate_hz: float
    range_deg_s: float
    sensitivity_rad_s: float
    temperature_scale_c: float
    temperature_offset_c: float

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
    """The board's health; counts since its last reset."""

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
    def of(cls, frame: Frame) -> Self:
        """A `report` frame."""
        values = frame.values
        return cls(
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


def reset_cause(frame: Frame) -> str:
    """Why the board last started, of an `identity` or `report` frame."""
    causes = dict(enumerate(protocol.RESET_CAUSES))
    return causes.get(frame.values.get("reset_cause", 0), "unknown")  # another version's identity may lack it
