"""What the board says of a calibration by hand that it makes by itself."""

from dataclasses import dataclass
from typing import Self

from firmware_host import protocol
from firmware_host.answers import Matrix, Vector
from firmware_host.frames import Frame


@dataclass(frozen=True, slots=True)
class HandReport:
    """A `hand_report`: how a session goes, and the move that was judged last, by board times in microseconds.

    `state` is one of `protocol.HAND_STATES`, `outcome` of `protocol.HAND_OUTCOMES`; `before` and `after` are faces of
    `protocol.HAND_FACES`, None on none. Of the rest before it, what was used begins at `rest_us` and ends where the
    move does begin, at `move_us`; of the rest after, it begins at `after_us` and ends at `end_us`.
    """

    sensor: int
    state: str
    outcome: str
    before: str | None
    after: str | None
    whole: bool
    settled: bool
    judged: int
    taken: int
    angle_rad: float
    noise_rad_s: float
    scale_std: float
    rest_us: int
    move_us: int
    after_us: int
    end_us: int

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """A `hand_report` frame."""
        values = dict(frame.values)
        del values["reply_to"]
        faces = dict(enumerate(protocol.HAND_FACES))
        return cls(
            **values
            | {
                "state": protocol.HAND_STATES[values["state"]],
                "outcome": protocol.HAND_OUTCOMES[values["outcome"]],
                "before": faces.get(values["before"]),
                "after": faces.get(values["after"]),
                "whole": bool(values["whole"]),
                "settled": bool(values["settled"]),
            }
        )


@dataclass(frozen=True, slots=True)
class HandSolved:
    """A `hand_solution`: g = C (m + b) of so many moves `taken`, in single precision; `matrix` is C.

    `g_sensitivity_rad_s` is what a reading has of the specific force, rad/s per g; `scale_std` the largest standard
    uncertainty of a scale factor by that session. The sensor was set up to `range_deg_s`, and as warm as
    `temperature_c` when it was last laid down.
    """

    sensor: int
    state: str
    taken: int
    scale_std: float
    range_deg_s: float
    temperature_c: float
    matrix: Matrix
    bias_rad_s: Vector
    g_sensitivity_rad_s: Matrix

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """A `hand_solution` frame."""
        values = frame.values
        return cls(
            sensor=values["sensor"],
            state=protocol.HAND_STATES[values["state"]],
            taken=values["taken"],
            scale_std=values["scale_std"],
            range_deg_s=values["range_deg_s"],
            temperature_c=values["temperature_c"],
            matrix=values["matrix"],
            bias_rad_s=values["bias_rad_s"],
            g_sensitivity_rad_s=values["g_sensitivity_rad_s"],
        )
