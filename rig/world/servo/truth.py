"""The true properties of a simulated servo and its line, known only to the world."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class ServoTruth:
    """One servo. Angles and rates are the shaft's.

    `settings`: EEPROM values other than the factory's, by the manual's names. The encoder's error at the angle θ is
    e₁ sin(θ + φ₁) + e₂ sin(2θ + φ₂), with e₁, φ₁ the fields `encoder_once_…` and e₂, φ₂ `encoder_twice_…`. AS5045-class
    parts are within ±1.3° in total. The gear's ripple is a fraction of the rate, `ripple_per_turn` times a revolution;
    the shaft follows the profile with `lag_s`. `tick_ppm`: the error of the servo's clock, positive if fast. With
    torque off the shaft falls with `fall_deg_s` (0: its load is balanced).
    """

    model: str = "XM430-W350"
    firmware: int = 48
    settings: Mapping[str, int] = field(default_factory=dict)
    start_deg: float = 30.0
    encoder_once_deg: float = 1.0
    encoder_once_phase_deg: float = 40.0
    encoder_twice_deg: float = 0.3
    encoder_twice_phase_deg: float = 110.0
    encoder_noise_deg: float = 0.06
    backlash_deg: float = 0.25
    ripple_fraction: float = 0.07
    ripple_per_turn: int = 20
    lag_s: float = 0.015
    tick_ppm: float = 3000.0
    temperature_c: float = 31.0
    voltage_v: float = 12.0
    boot_s: float = 0.2
    overload_after_s: float = 1.5
    fall_deg_s: float = 0.0
    seed: int = 1


@dataclass(frozen=True, slots=True)
class LineTruth:
    """The connection between host and servos. `latency_ms`: interval at which bytes are passed on (0: at once).

    `echo`: the host receives its own bytes, as with one-wire converters. `reply_delay_ms`: extra delay of every reply.
    """

    latency_ms: float = 0.0
    echo: bool = False
    reply_delay_ms: float = 0.0
