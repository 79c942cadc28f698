"""What a hand is asked to do, how well it does that, and by which mistakes it fails.

The sizes are those of published recordings of hands: two to five pushes a turn, peaks of 60 to 900 °/s, tremor of 6 to
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
USUAL: dict[MistakeKind, float] = {
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
    """A mistake, as large as `size`; None takes the usual size of its kind (`USUAL`).

    - `short`: the turn ends so many degrees before it is whole, as against an edge that slipped.
    - `two_turns` for one, the turn the `other_way` round, the `wrong_face`; `skipped`: nothing is done.
    - `crumb`: the face lies on something, tilted by so many mrad; `table_pushed`: the table leans otherwise then.
    - `held` in the air for so many seconds, and not laid down; `lifted` by so many degrees while it should rest.
    - `dropped`: biases have jumped; `cable_pulled` for so many seconds; `left` lying for so many; so many times
      `too_fast`.
    """

    kind: MistakeKind
    size: float | None = None

    @property
    def sized(self) -> float:
        return USUAL.get(self.kind, 0.0) if self.size is None else self.size


@dataclass(frozen=True, slots=True)
class FlipAction:
    """The body is laid on another face: its axis `to` then points upwards."""

    to: Face
    mistake: Mistake | None = None


@dataclass(frozen=True, slots=True)
class TurnAction:
    """The body is turned on its face by whole `turns`, about its axis that points upwards."""

    turns: int
    mistake: Mistake | None = None


@dataclass(frozen=True, slots=True)
class WaitAction:
    """The body is left alone."""

    seconds: float
    mistake: Mistake | None = None


Action = FlipAction | TurnAction | WaitAction


@dataclass(frozen=True, slots=True)
class Habits:
    """How a hand moves and lays down; sizes that are drawn anew each time are standard deviations.

    `tilt_mrad` is by how much a face that is put down again lies otherwise, `closure_mrad` by how much a turn against
    an edge misses, `heading_mrad` a flip. The box' faces are off square by `faces_mrad`, the table leans by
    `table_mrad`, the sensor lies `lever_arm_m` off the point about which it is turned.
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
