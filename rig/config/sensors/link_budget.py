"""The sensors' load on a serial link, in bytes per second, computed from the protocol's own table. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass

from firmware_host.protocol import BATCH_AGE_US, COBS_BYTES, MESSAGE_BY_NAME, OVERHEAD, PAYLOAD_MAX

BITS_PER_BYTE = 10  # start bit, eight data bits, stop bit
KVH1775_MESSAGE_BYTES = {"A": 36, "B": 40, "C": 38}  # ICD 56-0298 Rev. B, tables 5-1, 5-3, 5-5
HEADROOM = 0.1  # fraction of the link: for replies, and for a clock that is slightly wrong


@dataclass(frozen=True, slots=True)
class LinkLoad:
    """The stream of one sensor on the link: `rate_hz` samples per second, raw or `calibrated`.

    `acceleration`: whether raw samples also contain accelerations. `field`: whether the samples are a magnetometer's.
    """

    rate_hz: float
    calibrated: bool
    acceleration: bool = False
    field: bool = False

    @property
    def bytes_per_sample(self) -> float:
        """The bytes of one sample in a message of several samples, including its fraction of the message's overhead."""
        message = MESSAGE_BY_NAME[self._message]
        item, head = message.item_dtype.itemsize, message.head.size
        full_frame = (PAYLOAD_MAX - head) // item
        samples = min(full_frame, 1 + int(BATCH_AGE_US * 1e-6 * self.rate_hz))
        return item + (head + OVERHEAD + COBS_BYTES) / samples

    @property
    def _message(self) -> str:
        if self.field:
            return "field_samples"
        return "imu_samples" if self.acceleration else "rates" if self.calibrated else "samples"

    @property
    def bytes_per_s(self) -> float:
        """The load of the stream on the link, bytes/s."""
        return self.rate_hz * self.bytes_per_sample


def capacity_bytes_per_s(baud: int) -> float:
    """Return the load that a link at `baud` may have, bytes/s."""
    return baud / BITS_PER_BYTE * (1 - HEADROOM)


def over_budget(streams: Mapping[str, LinkLoad], baud: int) -> str | None:
    """Return an error text with the sum of all `streams` (by sensor) if it exceeds the link's capacity, else None."""
    needed = sum(stream.bytes_per_s for stream in streams.values())
    if needed <= capacity_bytes_per_s(baud):
        return None
    terms = " + ".join(
        f"{name} {stream.rate_hz:.6g} Hz × {stream.bytes_per_sample:.1f} bytes" for name, stream in streams.items()
    )
    return (
        f"the serial link cannot carry these rates: {terms} = {needed:.0f} bytes/s, but board.baud {baud} / "
        f"{BITS_PER_BYTE} bits a byte less {HEADROOM:.0%} kept free = {capacity_bytes_per_s(baud):.0f} bytes/s; "
        "lower rate_hz or raise board.baud"
    )


def sensor_line_over_budget(rate_hz: float, message_bytes: int, baud: int) -> str | None:
    """Return an error text if a sensor's messages exceed the capacity of its own line, else None."""
    if rate_hz * message_bytes <= capacity_bytes_per_s(baud):
        return None
    return (
        f"its line cannot carry this rate: {rate_hz:g} Hz × {message_bytes} bytes = {rate_hz * message_bytes:g} "
        f"bytes/s, but serial.baud {baud} / {BITS_PER_BYTE} bits a byte less {HEADROOM:.0%} kept free = "
        f"{capacity_bytes_per_s(baud):.0f} bytes/s; lower rate_hz, or set the sensor to a higher baud rate"
    )
