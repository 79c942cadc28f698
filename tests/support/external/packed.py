"""Compression by zstd, which Python has from 3.14 on."""

import sys
from functools import cache

if sys.version_info >= (3, 14):
    from compression.zstd import ZstdCompressor, compress
else:
    from backports.zstd import ZstdCompressor, compress

MEGABYTE = bytes(1 << 20)


def zstd(data: bytes) -> bytes:
    """Return the compressed bytes."""
    return compress(data)


@cache
def pack_zeros(size: int) -> bytes:
    """Return `size` zeros compressed to a thirty-thousandth, in one frame that states the size."""
    packing = ZstdCompressor()
    packing.set_pledged_input_size(size)
    parts = [packing.compress(MEGABYTE) for _ in range(size >> 20)]
    return b"".join([*parts, packing.flush()])
