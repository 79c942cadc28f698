"""The layout of a received sample, shared by the link that decodes it and the recorder that stores it."""

import numpy as np

STAMPS = (
    ("sequence", "<u4"),  # counts every conversion the board saw, so a gap is a lost sample
    ("board_time_us", "<u8"),  # the board's microsecond counter, read before the bus transfer
    ("host_time_s", "<f8"),  # time.monotonic() when the frame's last byte was read
)
SAMPLE_DTYPE = np.dtype(
    [
        *STAMPS,
        ("counts", "<i4", (3,)),  # x, y, z as the part reports them
        ("temperature_counts", "<i2"),
    ]
)
# Samples with accelerations: x, y, z of the same conversion, in the axes of `counts`.
IMU_SAMPLE_DTYPE = np.dtype([*SAMPLE_DTYPE.descr, ("acceleration_counts", "<i4", (3,))])
# Samples of a magnetometer, which has no thermometer: x, y, z of the field as the part reports them.
FIELD_SAMPLE_DTYPE = np.dtype([*STAMPS, ("field_counts", "<i4", (3,))])
