"""Frames of the stream that came in one read become as few batches as there can be."""

import numpy as np

from firmware_host.answers import SampleBatch, sample_batches
from firmware_host.frames import FrameReader, encode
from firmware_host.protocol import MESSAGE_BY_NAME


def streamed(sensor: int, first: int, count: int, dropped: int = 0) -> tuple[dict[str, int], np.ndarray]:
    """A frame's fields and items: conversion n was at 1000 n microseconds and read n."""
    fields = {"sensor": sensor, "mode": 0, "sequence": first, "dropped": dropped, "count": count}
    items = np.zeros(count, MESSAGE_BY_NAME["samples"].item_dtype)
    items["delta_us"] = 1000 * np.arange(count)
    items["counts"] = np.arange(first, first + count)[:, None]
    return {**fields, "base_time_us": 1000 * first}, items


def arrived(*frames: tuple[dict[str, int], np.ndarray]) -> list[SampleBatch]:
    wire = b"".join(encode("samples", number, *frame) for number, frame in enumerate(frames))
    return list(sample_batches(FrameReader().feed(wire), host_time_s=7.0))


def test_frames_of_two_sensors_in_turns_become_a_batch_of_each() -> None:
    batches = arrived(streamed(0, 0, 5), streamed(2, 0, 3), streamed(0, 5, 4, dropped=0), streamed(2, 3, 3))
    assert [(batch.sensor, batch.samples["sequence"].tolist()) for batch in batches] == [
        (0, list(range(9))),
        (2, list(range(6))),
    ]
    for batch in batches:
        assert batch.samples["board_time_us"].tolist() == [1000 * n for n in batch.samples["sequence"].tolist()]
        assert batch.samples["counts"][:, 2].tolist() == batch.samples["sequence"].tolist()
        assert set(batch.samples["host_time_s"].tolist()) == {7.0}


def test_a_batch_ends_at_missing_conversions_and_their_latest_count_is_reported() -> None:
    batches = arrived(
        streamed(0, 0, 5), streamed(0, 5, 5), streamed(0, 12, 5, dropped=2), streamed(0, 17, 1, dropped=3)
    )
    assert [(batch.samples["sequence"][0], len(batch.samples), batch.dropped) for batch in batches] == [
        (0, 10, 0),
        (12, 6, 3),
    ]
