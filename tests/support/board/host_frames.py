"""The firmware's codec and receiver, called from Python."""

import ctypes

from support.board.host_board import core

Frame = tuple[int, int, bytes]  # type, sequence, payload

_ON_FRAME = ctypes.CFUNCTYPE(None, ctypes.c_uint8, ctypes.c_uint8, ctypes.POINTER(ctypes.c_uint8), ctypes.c_size_t)
_WIRE_MAX = 248  # of frame.h


class _CFrame(ctypes.Structure):
    """`struct frame` of core/link/frame.h."""

    _fields_ = (
        ("type", ctypes.c_uint8),
        ("sequence", ctypes.c_uint8),
        ("size", ctypes.c_uint8),
        ("payload", ctypes.POINTER(ctypes.c_uint8)),
    )


def encode_in_c(kind: int, sequence: int, payload: bytes) -> bytes:
    """Return one frame with its delimiter."""
    buffer = (ctypes.c_uint8 * len(payload)).from_buffer_copy(payload)
    frame = _CFrame(kind, sequence, len(payload), ctypes.cast(buffer, ctypes.POINTER(ctypes.c_uint8)))
    wire = ctypes.create_string_buffer(_WIRE_MAX)
    size = core().frame_encode(ctypes.byref(frame), wire)
    return wire.raw[:size]


def decode_in_c(block: bytes) -> Frame | None:
    """Decode a block without its delimiter; return None if it is damaged."""
    buffer = ctypes.create_string_buffer(block, max(len(block), 1))
    frame = _CFrame()
    if not core().frame_decode(buffer, ctypes.c_size_t(len(block)), ctypes.byref(frame)):
        return None
    return frame.type, frame.sequence, ctypes.string_at(frame.payload, frame.size)


class CReceiver:
    """The firmware's receiver after a reset. There is one per process."""

    def __init__(self) -> None:
        core().link_reset()

    @property
    def damaged(self) -> int:
        """The number of blocks that could not be decoded."""
        return int(core().link_rx_errors())

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes."""
        frames: list[Frame] = []
        on_frame = _ON_FRAME(
            lambda kind, sequence, payload, size: frames.append((kind, sequence, ctypes.string_at(payload, size)))
        )
        core().host_receive(data, ctypes.c_size_t(len(data)), on_frame)
        return frames
