"""The board's answers on a calibration by hand that it computes itself."""

from dataclasses import dataclass
from typing import Self

from firmware_host import protocol
from firmware_host.answers import Matrix, Vector
from firmware_host.frames import Frame


@dataclass(frozen=True, slots=True)
class HandReport:
    """A `hand_report`: the progress of a session, and the last judged move. Times are board times in microseconds.

    - `sensor`, `state`: its index, and one of `protocol.HAND_STATES`.
    - `outcome`: that of the last move, one of `protocol.HAND_OUTCOMES`.
    - `before`, `after`: the faces at its ends, of `protocol.HAND_FACES`; None for no face.
    - `whole`: whether whole revolutions on a face count as closed.
    - `settled`: whether the equations are linearized about the solution after that move.
    - `judged`, `accepted`: the numbers of moves judged and accepted.
    - `angle_rad`: the rotation of that move, there and back.
    - `noise_rad_s`: the standard deviation of a reading at rest, used as its weight.
    - `scale_std`: the largest standard uncertainty of a scale factor.
    - `rest_us`, `move_us`: the start of the used part of the rest before that move, and of the move.
    - `after_us`, `end_us`: the start of the rest after the move, and the end of its used part.
    """

    sensor: int
    state: str
    outcome: str
    before: str | None
    after: str | None
    whole: bool
    settled: bool
    judged: int
    accepted: int
    angle_rad: float
    noise_rad_s: float
    scale_std: float
    rest_us: int
    move_us: int
    after_us: int
    end_us: int

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `hand_report` frame."""
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
class BoardHandSolution:
    """A `hand_solution` from `accepted` moves, in single precision: rate g = C (m + b), with the reading m.

    - `sensor`, `state`, `accepted`: its index, one of `protocol.HAND_STATES`, and the number of accepted moves.
    - `scale_std`: the largest standard uncertainty of a scale factor by that session.
    - `range_deg_s`, `temperature_c`: the sensor's range, and its temperature when it was last laid down.
    - `matrix`, `bias_rad_s`: C and b.
    - `g_sensitivity_rad_s`: the effect of specific force on a reading, rad/s per g.
    """

    sensor: int
    state: str
    accepted: int
    scale_std: float
    range_deg_s: float
    temperature_c: float
    matrix: Matrix
    bias_rad_s: Vector
    g_sensitivity_rad_s: Matrix

    @classmethod
    def decode(cls, frame: Frame) -> Self:
        """Decode a `hand_solution` frame."""
        values = frame.values
        return cls(
            sensor=values["sensor"],
            state=protocol.HAND_STATES[values["state"]],
            accepted=values["accepted"],
            scale_std=values["scale_std"],
            range_deg_s=values["range_deg_s"],
            temperature_c=values["temperature_c"],
            matrix=values["matrix"],
            bias_rad_s=values["bias_rad_s"],
            g_sensitivity_rad_s=values["g_sensitivity_rad_s"],
        )
