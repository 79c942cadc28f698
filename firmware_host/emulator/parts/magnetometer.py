"""The simulated magnetometer: from the true magnetic flux density, through the part's errors and noise, in tesla."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from firmware_host.emulator.parts.triad import Seed, Triad, TriadErrors

GAUSS_T = 1e-4
_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MagnetometerTruth:
    """The true errors of a simulated magnetometer in the paper TRIAX's model m = F B + b: reading m, field B, tesla.

    `scale`: the reciprocal length of each row of F. `bias_t`: b, including hard iron fixed to the part. `noise_t`: the
    standard deviation of one reading. `non_orthogonality_rad`: as in `GyroTruth`.
    """

    scale: Sequence[float] = (1.0, 1.0, 1.0)
    bias_t: Sequence[float] = _NONE
    noise_t: float = 0.0
    non_orthogonality_rad: Sequence[float] = _NONE


class Magnetometer:
    """Three sensing axes with the errors of `truth`. `field_at(time_s)`: the flux density in the part's own axes, T."""

    def __init__(self, field_at: Callable[[float], Sequence[float]], truth: MagnetometerTruth, seed: Seed) -> None:
        self._field_at = field_at
        errors = TriadErrors(
            scale=truth.scale,
            bias=[-bias for bias in truth.bias_t],
            noise=truth.noise_t,
            non_orthogonality_rad=truth.non_orthogonality_rad,
            scale_per_k=_NONE,
            bias_per_k=_NONE,
            holds_at_c=25.0,
            bandwidth_hz=None,
            instability=0.0,
            instability_time_s=100.0,
            random_walk_per_sqrt_s=0.0,
        )
        self._triad = Triad(errors, seed, errors.holds_at_c)

    def read(self, time_s: float) -> list[float]:
        """Return the next reading, (3,) T, at `time_s`."""
        return self._triad.read(time_s, self._triad.sense(self._field_at(time_s), 0.0), 0.0)
