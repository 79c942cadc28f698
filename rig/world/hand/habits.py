"""The actions asked of a hand, its accuracy, and its mistakes.

The values are those of published recordings of hands: two to five pushes a turn, peaks of 60 to 900 °/s, tremor of 6 to
12 Hz, faces put down again within a fraction of a milliradian.
"""

from dataclasses import dataclass
from typing import Literal

Face = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
MistakeKind = Literal[
    "short", "two_turns", "other_way", "wrong_face", "skipped", "crumb", "table_pushed", "held", "dropped",
    "cable_pulled", "left", "lifted", "too_fast",
]  # fmt: skip

FACES: tuple[Face, ...] = ("+x", "-x", "+y", "-y", "+z", "-z")
FLIPS: tuple[Face, ...] = ("+x", "+y", "-z", "-x", "-y", "+z", "+y", "-x", "-z", "+x", "-y", "+z")
MISTAKE_SIZES: dict[MistakeKind, float] = {
    "short": 2.0,  # °
    "crumb": 5.0,  # mrad
    "table_pushed": 10.0,  # mrad
    "held": 2.5,  # s
    "dropped": 0.3,  # °/s
    "cable_pulled": 0.1,  # s
    "left": 60.0,  # s
    "lifted": 3.0,  # °
    "too_fast": 4.0,  # times
}


@dataclass(frozen=True, slots=True)
class Mistake:
    """A mistake of magnitude `size`; if `size` is None, it has the usual magnitude of its kind (`MISTAKE_SIZES`).

    - "short": the turn ends this many degrees early, as if the edge had slipped.
    - "two_turns": two turns in place of one; "other_way": a turn in the other direction; "wrong_face": another face up;
      "skipped": no action.
    - "crumb": the face is tilted by this many mrad; "table_pushed": the table's tilt changes by this many mrad.
    - "held": the body is held in the air for this many seconds in place of a rest; "lifted": it is lifted by this many
      degrees during a rest.
    - "dropped": the body falls and its biases jump by this many °/s; "cable_pulled": readings are lost for this many
      seconds; "left": the hand waits for this many seconds before the action.
    - "too_fast": the peak rate is higher by this factor.
    """

    kind: MistakeKind
    size: float | None = None

    @property
    def magnitude(self) -> float:
        """The magnitude of the mistake, in the unit of the mistake's kind."""
        return MISTAKE_SIZES.get(self.kind, 0.0) if self.size is None else self.size


@dataclass(frozen=True, slots=True)
class FlipAction:
    """The action of laying the body on another face, so that its axis `to` points upwards."""

    to: Face
    mistake: Mistake | None = None


@dataclass(frozen=True, slots=True)
class TurnAction:
    """The action of turning the body on its face by whole `turns` about its upward axis."""

    turns: int
    mistake: Mistake | None = None


@dataclass(frozen=True, slots=True)
class WaitAction:
    """The action of leaving the body alone for `seconds`."""

    seconds: float
    mistake: Mistake | None = None


Action = FlipAction | TurnAction | WaitAction


@dataclass(frozen=True, slots=True)
class Habits:
    """The habits of a hand that moves a body and lays it down. Values drawn for every action are standard deviations.

    `tilt_mrad`: repeatability of a face put down again; `closure_mrad`: heading error after a turn against an edge;
    `heading_mrad`: heading error after a flip; `faces_mrad`: the faces' deviation from right angles; `table_mrad`: the
    table's tilt; `lever_arm_m`: the sensor's position from the point of rotation.
    """

    peak_deg_s: float = 250.0
    pushes_a_turn: tuple[int, int] = (2, 5)
    pause_s: tuple[float, float] = (0.02, 0.25)
    wobble_deg: float = 1.5
    tremor_deg: float = 0.15
    rock_mrad: float = 3.0
    knock_g: tuple[float, float] = (1.0, 5.0)
    tilt_mrad: float = 0.3
    heading_mrad: float = 8.0
    closure_mrad: float = 3.0
    faces_mrad: float = 2.0
    table_mrad: float = 5.0
    lever_arm_m: tuple[float, float, float] = (0.02, 0.01, 0.015)
    earth_rate_rad_s: tuple[float, float, float] = (4.5e-5, 0.0, 5.7e-5)
    gravity_m_s2: float = 9.81
