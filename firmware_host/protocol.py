"""The protocol between host and board: one table of messages, for Python here and, through `c_header.py`, for C.

A frame is `COBS(type u8, sequence u8, payload, CRC u32) 0x00`, everything little-endian. The CRC is that of zlib and
Ethernet, over type, sequence and payload. A frame is shorter than 254 bytes, so COBS never needs a second block.

The CRC has 32 bits because one flipped bit can move a COBS zero. The damage after decoding is then no short burst but
nearly random, and a CRC of 16 bits accepts one random frame in 65536.

The host chooses the sequence of its frames, 1 … 255; the board's answer repeats it in `reply_to`. A board's own frames
count modulo 256, so a missing number is a lost frame. `reply_to` 0 marks unrequested frames.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np

from firmware_host.problem import Problem

PROTOCOL_VERSION = 6
FIRMWARE_VERSION = "0.9.0"  # of the shipped image
PAYLOAD_MAX = 240
OVERHEAD = 6  # bytes of a frame around its payload before COBS: type, sequence, CRC
COBS_BYTES = 2  # added by COBS: the code byte and the delimiter
BAUD_RATE = 921600  # of the shipped image
HEATER_WORD_US = 2_000_000  # the heater switches off without a request of the host in this time
HEATER_LIMIT_C = 70.0  # and at this reading of any part's thermometer
HEATER_POWERS = 255  # its full duty
BATCH_AGE_US = 80_000  # the longest time a sample waits in an incomplete batch; a full frame is sent at once
FULL_SCALE_COUNTS = 32767  # of raw readings: all parts report 16 bits, two's complement
CALIBRATED_RAD_S = 1e-6  # a count of calibrated readings, which are in microradians per second
# Bound on a sensor's scale factor and its inverse. From equal observations only noise remains,
# which simulates a scale factor beyond it: the board reports that as degenerate.
MAX_SCALE = 4.0

MODES = ("raw", "calibrated")
QUANTITIES = (
    "rate",
    "field",
)  # quantity of a sensor: a gyroscope (with or without accelerations), a magnetometer
RESET_CAUSES = ("unknown", "power", "pin", "software", "watchdog", "fault")
# Calibration models: g = K (m + b) with K diagonal, SIX Eq. (3), and the same with a full matrix for K.
MODELS = ("none", "k_times_m_plus_b", "matrix_times_m_plus_b")
METHODS = ("closed_form", "algorithm_1")
SOLUTION_STATUSES = ("solved", "too_few_observations", "degenerate", "not_converged")
# States of a session by hand, and outcomes of its last move.
HAND_STATES = ("idle", "starting", "moving", "resting", "done", "failed")
HAND_OUTCOMES = ("nothing", "accepted", "clipped", "lost", "no_face", "contradicts")
HAND_FACES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the sensor's axis that points upwards
HEATER_CAUSES = ("on", "not_wanted", "no_word", "too_hot", "no_thermometer")  # reasons for being off
ENUMERATIONS = {  # name → prefix of its values in C, the values counted from 0
    "reset_cause": ("RESET", RESET_CAUSES),
    "sample_mode": ("MODE", MODES),
    "sensor_quantity": ("QUANTITY", QUANTITIES),
    "calibration_model": ("MODEL", MODELS),
    "solve_method": ("METHOD", METHODS),
    "solution_status": ("SOLUTION", SOLUTION_STATUSES),
    "hand_state": ("HAND", HAND_STATES),
    "hand_outcome": ("MOVE", HAND_OUTCOMES),
    "heater_cause": ("HEATER", HEATER_CAUSES),
}

# kind → (struct code, C type, C array suffix)
KINDS = {
    "u8": ("B", "uint8_t", ""),
    "u16": ("H", "uint16_t", ""),
    "u32": ("I", "uint32_t", ""),
    "u64": ("Q", "uint64_t", ""),
    "i16": ("h", "int16_t", ""),
    "f32": ("f", "float", ""),
    "f64": ("d", "double", ""),
    "bytes12": ("12s", "uint8_t", "[12]"),
    "text12": ("12s", "char", "[12]"),
    "text24": ("24s", "char", "[24]"),
    "vector_i16": ("3h", "int16_t", "[3]"),
    "vector_i32": ("3i", "int32_t", "[3]"),
    "vector_f32": ("3f", "float", "[3]"),
    "matrix_f32": ("9f", "float", "[3][3]"),
}


@dataclass(frozen=True, slots=True)
class Field:
    """One value in a payload; `meaning` names its unit."""

    name: str
    kind: str
    meaning: str

    @property
    def rows(self) -> int:
        """The number of rows of three numbers: 1 for a vector, 3 for a matrix, 0 otherwise."""
        return {"vector": 1, "matrix": 3}.get(self.kind.partition("_")[0], 0)


@dataclass(frozen=True)
class Message:
    """One kind of frame: fixed fields, then any number of items of one layout."""

    code: int
    name: str
    sender: str
    meaning: str
    fields: tuple[Field, ...] = ()
    items: tuple[Field, ...] = ()

    @cached_property
    def head(self) -> struct.Struct:
        """The layout of the fixed fields."""
        return struct.Struct("<" + "".join(KINDS[field.kind][0] for field in self.fields))

    @cached_property
    def item_dtype(self) -> np.dtype[np.void]:
        """The layout of one item; an empty one without items."""
        codes = {"bytes12": "V12", "text12": "S12", "text24": "S24"}
        vectors = {"vector_i16": "(3,)<i2", "vector_i32": "(3,)<i4", "vector_f32": "(3,)<f4", "matrix_f32": "(3,3)<f4"}
        return np.dtype([(f.name, (codes | vectors).get(f.kind, "<" + KINDS[f.kind][0])) for f in self.items])

    @cached_property
    def _names(self) -> tuple[str, ...] | None:
        """The names of the values that `head` unpacks; None if some are vectors or matrices."""
        return None if any(field.rows for field in self.fields) else tuple(field.name for field in self.fields)

    def name_values(self, values: tuple[Any, ...]) -> dict[str, Any]:
        """Return the values that `head` unpacks, by field name; a vector is a tuple, a matrix a tuple of three rows."""
        if self._names is not None:  # a short path for frequent frames
            return dict(zip(self._names, values))  # noqa: B905 - as many as `head` unpacks
        rest = iter(values)
        return {field.name: _next(field.rows, rest) for field in self.fields}


def _next(rows: int, values: Iterator[Any]) -> Any:
    """Take from `values`, which `head` has unpacked, the next value, vector or matrix, and return it."""
    if rows == 0:
        return next(values)
    rows_of_three = tuple(tuple(islice(values, 3)) for _ in range(rows))
    return rows_of_three if rows > 1 else rows_of_three[0]


REPLY_TO = Field("reply_to", "u8", "sequence of the answered frame, 0 = unrequested")
SENSOR = Field("sensor", "u8", "index in the identity's list")
SENSORS = Field("sensors", "u8", "mask of sensors: bit i is the sensor of index i in the identity's list")
BATCH = (  # the first fields of samples, imu_samples, field_samples and rates
    SENSOR,
    Field("mode", "u8", "enum sample_mode"),
    Field("sequence", "u32", "of the first sample; counts every conversion of the part since start"),
    Field("dropped", "u32", "conversions since start that were not sent in a frame"),
    Field("base_time_us", "u64", "board time of the first sample, read before the bus transfer"),
    Field("count", "u8", "number of samples"),
)
DELTA = Field("delta_us", "u32", "board time after base_time_us")
COUNTS = Field("counts", "vector_i16", "angular rate: x, y, z as the part reports them, in right-handed axes")
TEMPERATURE = Field("temperature_counts", "i16", "as the part reports it")
CALIBRATION = (  # the host's part of a calibration; the board adds the part that it was measured on
    Field("model", "u8", "enum calibration_model"),
    Field("serial_number", "text24", "of the sensor, as the configuration names it"),
    Field("written_unix_s", "u64", "when it was written, seconds since 1970 UTC"),
    Field("temperature_c", "f32", "of matrix and bias, by the sensor's own thermometer, degrees Celsius"),
    Field("matrix", "matrix_f32", "factor of m + b, row by row; diagonal for k_times_m_plus_b"),
    Field("bias_rad_s", "vector_f32", "b, in the units of the reading"),
    Field("lowest_c", "f32", "lower end of the polynomials' range; constant below it"),
    Field("highest_c", "f32", "upper end of that range; without polynomials both are temperature_c"),
    Field("scale_change", "matrix_f32", "k(T)/k − 1 per K, K², K³ from temperature_c, a row each; 0 = none"),
    Field("bias_change_rad_s", "matrix_f32", "b(T) − b likewise"),
)

MESSAGES = (
    Message(0x01, "hello", "host", "request for identity"),
    Message(
        0x02,
        "identity",
        "board",
        "answers hello; also sent twice a second while idle, to distinguish a wrong baud rate from silence",
        (
            REPLY_TO,  # these first two fields stay in every version of the protocol
            Field("protocol", "u8", "PROTOCOL_VERSION of the image"),
            Field("firmware", "text12", "version of the image"),
            Field("unique_id", "bytes12", "of the microcontroller"),
            Field("reset_cause", "u8", "cause of the last start: enum reset_cause"),
        ),
        (
            Field("part", "text12", "part the firmware has a driver for"),
            Field("who_am_i", "u16", "identity register as read"),
            Field("present", "u8", "1 = the identity register reads as the part's"),
            Field("quantity", "u8", "enum sensor_quantity"),
        ),
    ),
    Message(
        0x03,
        "configure",
        "host",
        "set a sensor up; answered by setup",
        (
            SENSOR,
            Field("rate_hz", "f32", "requested data rate, Hz; the nearest is set"),
            Field("range_deg_s", "f32", "requested range, degrees per second; the next one up; 0 for a magnetometer"),
            Field("range_g", "f32", "requested range of accelerations, g; the next one up; 0 = none"),
            Field(
                "range_gauss", "f32", "requested range of a magnetometer, gauss; the next one up; 0 for other sensors"
            ),
        ),
    ),
    Message(
        0x04,
        "setup",
        "board",
        "actual settings of the part",
        (
            REPLY_TO,
            SENSOR,
            Field("rate_hz", "f64", "nominal data rate, Hz"),
            Field("range_deg_s", "f64", "range, degrees per second; 0 = no rates are sent"),
            Field("sensitivity_rad_s", "f64", "rad/s per count; 0 = none are sent"),
            Field("temperature_scale_c", "f64", "degrees Celsius per count; 0 = no temperature is sent"),
            Field("temperature_offset_c", "f64", "degrees Celsius at count 0"),
            Field("range_m_s2", "f64", "range of accelerations, m/s²; 0 = none are sent"),
            Field("sensitivity_m_s2", "f64", "m/s² per count; 0 = none are sent"),
            Field("range_t", "f64", "range of the magnetic field, tesla; 0 = none is sent"),
            Field("sensitivity_t", "f64", "tesla per count; 0 = none is sent"),
        ),
    ),
    Message(
        0x05,
        "start",
        "host",
        "stream every configured sensor, sequences from 0: selected ones calibrated, the others raw; answered by ack",
        (SENSORS,),
    ),
    Message(0x06, "stop", "host", "stop streaming; the ack follows the last samples"),
    Message(0x07, "ack", "board", "request executed", (REPLY_TO,)),
    Message(
        0x08,
        "samples",
        "board",
        "a run of raw samples with consecutive sequence numbers",
        BATCH,
        (DELTA, COUNTS, TEMPERATURE),
    ),
    Message(0x09, "status", "host", "request for report"),
    Message(
        0x0A,
        "report",
        "board",
        "the board's health",
        (
            REPLY_TO,
            Field("uptime_us", "u64", "board time"),
            Field("rx_errors", "u32", "frames from the host that were damaged or too long"),
            Field("tx_overruns", "u32", "frames not sent for lack of room"),
            Field("bus_errors", "u32", "sensor reads that did not carry new data"),
            Field("stack_high_water", "u32", "most stack ever used, bytes"),
            Field("fault_pc", "u32", "address of the last processor fault, 0 = none"),
            Field("reset_cause", "u8", "enum reset_cause"),
            Field("clock_locked", "u8", "1 = the clock follows the 32768 Hz crystal"),
            Field("streaming", "u8", "1 = between start and stop"),
        ),
        (
            Field("conversions", "u32", "conversions seen since start"),
            Field("samples", "u32", "conversions sent in a frame"),
            Field("dropped", "u32", "conversions lost on the board"),
        ),
    ),
    Message(
        0x0B,
        "error",
        "board",
        "refusal of a request, or a fault of the board",
        (REPLY_TO, Field("code", "u8", "enum error_code"), SENSOR),
    ),
    Message(0x0C, "reboot", "host", "restart; the ack comes before"),
    Message(
        0x0D,
        "rates",
        "board",
        "a run of calibrated samples with consecutive sequence numbers",
        BATCH,
        (DELTA, Field("rate_urad_s", "vector_i32", "x, y, z calibrated, microradians per second"), TEMPERATURE),
    ),
    Message(
        0x0E,
        "keep",
        "host",
        "store the readings from now on for observe; earlier ones are discarded; answered by ack",
        (SENSORS, Field("duration_s", "f32", "least duration, s")),
    ),
    Message(
        0x0F,
        "observe",
        "host",
        "average stored readings of a sensor between two board times and add an observation; answered by observed",
        (
            SENSOR,
            Field(
                "index", "u16", "0 starts a new set; else the number of earlier observations; the last may be repeated"
            ),
            Field("start_us", "u64", "board time"),
            Field("end_us", "u64", "board time"),
            Field("speed_rad_s", "f32", "magnitude of the angular rate meanwhile, rad/s"),
        ),
    ),
    Message(
        0x10,
        "observed",
        "board",
        "average of the samples from start_us up to, not including, end_us",
        (
            REPLY_TO,
            SENSOR,
            Field("index", "u16", "of the observation"),
            Field("start_us", "u64", "board time of the first sample used; within the requested span"),
            Field("end_us", "u64", "board time of the first sample after those used; within the requested span"),
            Field("samples", "u32", "number of samples used"),
            Field("mean_rad_s", "vector_f32", "their mean, uncalibrated, rad/s"),
        ),
    ),
    Message(
        0x11,
        "solve",
        "host",
        "calibrate a sensor from its observations; answered by solution",
        (SENSOR, Field("method", "u8", "enum solve_method")),
    ),
    Message(
        0x12,
        "solution",
        "board",
        "a calibration g = K (m + b) in single precision",
        (
            REPLY_TO,
            SENSOR,
            Field("method", "u8", "enum solve_method"),
            Field("status", "u8", "enum solution_status; unless solved, scale and bias are 0"),
            Field("observations", "u16", "number of observations"),
            Field("iterations", "u8", "steps taken"),
            Field("scale", "vector_f32", "diagonal of K"),
            Field("bias_rad_s", "vector_f32", "b, in the units of the reading"),
        ),
    ),
    Message(0x13, "read_calibration", "host", "request for a sensor's calibration", (SENSOR,)),
    Message(
        0x14,
        "calibration",
        "board",
        "the stored calibration of a sensor",
        (
            REPLY_TO,
            SENSOR,
            Field("sequence", "u32", "counts the calibrations ever stored for this sensor, from 1"),
            Field("part", "text12", "part it was stored for"),
            Field("who_am_i", "u16", "that part's identity register"),
            Field("range_deg_s", "f32", "range it was stored for, degrees per second"),
            *CALIBRATION,
        ),
    ),
    Message(
        0x15,
        "write_calibration",
        "host",
        "store a calibration of a configured sensor; the old one stays until the new one is complete; answered by ack",
        (SENSOR, *CALIBRATION),
    ),
    Message(0x16, "erase_calibration", "host", "erase the calibration of a sensor; answered by ack", (SENSOR,)),
    Message(
        0x17,
        "recall",
        "host",
        "add an observation of this board from before a reset; answered by observed, of no samples",
        (
            SENSOR,
            Field("index", "u16", "as in observe"),
            Field("mean_rad_s", "vector_f32", "as observed then, rad/s"),
            Field("speed_rad_s", "f32", "magnitude of the angular rate then, rad/s"),
        ),
    ),
    Message(
        0x18,
        "imu_samples",
        "board",
        "replaces samples if accelerations are requested: both triads of one conversion",
        BATCH,
        (
            DELTA,
            COUNTS,
            Field(
                "acceleration",
                "vector_i16",
                "specific force: x, y, z in the same axes; at rest the axis up is positive",
            ),
            TEMPERATURE,
        ),
    ),
    Message(
        0x19,
        "field_samples",
        "board",
        "replaces samples for a magnetometer",
        BATCH,
        (DELTA, Field("field", "vector_i16", "magnetic flux density: x, y, z as the part reports them, right-handed")),
    ),
    Message(
        0x1A,
        "heat",
        "host",
        "switch the heater on or off; without a repetition within two seconds it switches off; answered by heating",
        (Field("power", "u8", "duty of the heater's pin, of 255; 0 = off"),),
    ),
    Message(
        0x1B,
        "heating",
        "board",
        "present state of the heater",
        (
            REPLY_TO,
            Field("power", "u8", "of 255, 0 = off"),
            Field(
                "cause", "u8", "enum heater_cause: reason for being off; too_hot remains until the host switches it off"
            ),
            Field("temperature_c", "f32", "of the hottest part at the board's last look, degrees Celsius"),
        ),
    ),
    Message(
        0x30,
        "by_hand",
        "host",
        "begin to calibrate by hand a sensor that is set up with accelerations; answered by ack",
        (
            SENSOR,
            Field("moves", "u8", "least number of accepted moves"),
            Field("scale_std", "f32", "largest standard uncertainty of the scale at the end"),
        ),
    ),
    Message(0x31, "hand_status", "host", "request for hand_report"),
    Message(
        0x32,
        "hand_report",
        "board",
        "progress of a calibration by hand, and its last judged move",
        (
            REPLY_TO,
            SENSOR,
            Field("state", "u8", "enum hand_state"),
            Field("outcome", "u8", "enum hand_outcome, of the last judged move"),
            Field("before", "u8", "face it began on: 0 to 5 are +x -x +y -y +z -z upwards, 255 none"),
            Field("after", "u8", "face it ended on; before any move, the one it lay on at first"),
            Field("whole", "u8", "1 = whole revolutions on a face, which count as closed"),
            Field("settled", "u8", "1 = the equations are linearized about the solution after it from then on"),
            Field("judged", "u16", "moves judged so far"),
            Field("accepted", "u8", "accepted moves"),
            Field("angle_rad", "f32", "rotation of that move, there and back"),
            Field("noise_rad_s", "f32", "standard deviation of a reading at rest, used as its weight"),
            Field("scale_std", "f32", "largest standard uncertainty of a scale factor"),
            Field("rest_us", "u64", "board time of the first sample used of the rest before"),
            Field("move_us", "u64", "of the first of the move, which is the first after that rest"),
            Field("after_us", "u64", "of the first of the rest after, which is the first after the move"),
            Field("end_us", "u64", "of the first after the part used of that rest"),
        ),
    ),
    Message(0x33, "hand_solve", "host", "request for hand_solution"),
    Message(
        0x34,
        "hand_solution",
        "board",
        "a calibration g = C (m + b) by hand in single precision, with the g-sensitivity's part removed from m",
        (
            REPLY_TO,
            SENSOR,
            Field("state", "u8", "enum hand_state"),
            Field("accepted", "u8", "number of accepted moves"),
            Field("scale_std", "f32", "largest standard uncertainty of a scale factor"),
            Field("range_deg_s", "f32", "range of the sensor, degrees per second"),
            Field("temperature_c", "f32", "of the sensor when it was last laid down, degrees Celsius"),
            Field("matrix", "matrix_f32", "C, row by row"),
            Field("bias_rad_s", "vector_f32", "b, in the units of the reading"),
            Field("g_sensitivity_rad_s", "matrix_f32", "of a reading, rad/s per g of specific force, row by row"),
        ),
    ),
)


ERRORS = {  # code → what the board reports; `what` continues "the board says that"
    1: Problem("unknown_message", "it does not know this request", "Flash the image that comes with this program"),
    2: Problem("bad_length", "the request has the wrong length", "Flash the image that comes with this program"),
    3: Problem("no_such_sensor", "it has no sensor of this number", "Check the sensors in the configuration"),
    4: Problem("sensor_absent", "the sensor does not answer on its bus", "Check its supply and its SPI wires"),
    5: Problem("bad_rate", "the data rate is not a positive number", "Correct rate_hz in the configuration"),
    6: Problem(
        "bad_range", "the part has no such range", "Correct range_deg_s, range_g or range_gauss in the configuration"
    ),
    7: Problem(
        "no_calibration", "it has no calibration stored for this sensor", "Store one: `rig board calibration write`"
    ),
    8: Problem("setup_failed", "a setting did not read back as written", "Check the sensor's SPI wires and supply"),
    9: Problem("not_configured", "the sensor is not configured", "Configure it first"),
    10: Problem("busy_streaming", "it is streaming and cannot change settings", "Stop the stream first"),
    11: Problem("sensor_silent", "the sensor stopped signalling new data", "Check its interrupt wire and supply"),
    12: Problem("sensor_mismatch", "another part answers in the sensor's place", "Check the part and its chip select"),
    13: Problem("checksum_failed", "its data arrive damaged, again and again", "Check the sensor's SPI wires"),
    14: Problem("other_sensor", "the stored calibration is of another part or range", "Calibrate in this range"),
    15: Problem("not_kept", "it has not kept the readings of that time", "Ask it to keep them before the sweep"),
    16: Problem("bad_observation", "the observation is out of order or not finite", "Begin anew with observation 0"),
    17: Problem(
        "bad_calibration", "the calibration cannot be right: not finite, or of an unknown model", "Calibrate again"
    ),
    18: Problem("flash_failed", "its flash did not take what was written", "Replace the microcontroller board"),
    19: Problem("sensor_fault", "the sensor reports a fault of its own", "Check its supply; else replace the sensor"),
    20: Problem("not_a_gyroscope", "only a gyroscope can do this", "Leave the magnetometer out of the request"),
}

# Answers to requests other than `error`; those not listed are answered by `ack`.
ANSWERS = {
    "hello": "identity",
    "heat": "heating",
    "configure": "setup",
    "status": "report",
    "observe": "observed",
    "recall": "observed",
    "solve": "solution",
    "read_calibration": "calibration",
    "hand_status": "hand_report",
    "hand_solve": "hand_solution",
}
SAMPLES = ("samples", "imu_samples", "field_samples", "rates")  # the messages of a stream
MESSAGE_BY_CODE = {message.code: message for message in MESSAGES}
MESSAGE_BY_NAME = {message.name: message for message in MESSAGES}


def text(value: bytes) -> str:
    """Return a fixed-width text field as str."""
    return value.rstrip(b"\0").decode("ascii", "replace")
