"""Nothing passes that contradicts itself: planted damages of recordings, and recordings that have none."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from rig.analysis.contradictions import contradictions
from rig.analysis.outcome import calibrated
from rig.data.run_file import RunData
from rig.errors import Fault
from support.damaged_readings import (
    Damage,
    Mask,
    Readings,
    clipped,
    converted,
    curved,
    drifting,
    frozen,
    late,
    noisier,
    offset,
    old,
    readings_of,
    repeated,
    replaced,
    rolled,
    scaled,
    spiky,
    swapped,
    turned,
    wrapped,
)
from support.synthetic_run import Setup, truth


def later(seen: Readings) -> Mask:
    return seen.late


def turning(seen: Readings) -> Mask:
    return seen.turning


def sweep_2(seen: Readings) -> Mask:
    return seen.sweep(2)


def sweep_5(seen: Readings) -> Mask:
    return seen.sweep(5)


def half_of_sweep_1(seen: Readings) -> Mask:
    return seen.half_of(1)


def rest_3(seen: Readings) -> Mask:
    return seen.rest(3)


DISTURBED = ("disturbed_sweep",)
# What is damaged, and the names of which one at least must be told; a few are told by none, and the truth must be met.
DAMAGES: dict[str, tuple[tuple[str, ...], Damage]] = {
    "offset of 0.01 rad/s in one sweep": (DISTURBED, offset(0.01, sweep_2)),
    "offset of 0.02 rad/s in one sweep": (DISTURBED, offset(0.02, sweep_2)),
    "offset of 0.05 rad/s in one sweep": (DISTURBED, offset(0.05, sweep_5)),
    "offset of 0.01 rad/s in half a sweep": (DISTURBED, offset(0.01, half_of_sweep_1)),
    "offset of 0.02 rad/s in half a sweep": (DISTURBED, offset(0.02, half_of_sweep_1)),
    "offset of 0.01 rad/s in all sweeps": (("sweeps_against_rests",), offset(0.01, turning)),
    "offset of 0.01 rad/s in one rest": (("residuals",), offset(0.01, rest_3)),
    "scale changes by 0.5 % half-way": (("scale_changed",), scaled(1.005, later)),
    "scale changes by 1 % half-way": (("scale_changed",), scaled(1.01, later)),
    "scale changes by 2 % half-way": (("scale_changed",), scaled(0.98, later)),
    "one axis' scale changes by 1 % half-way": (("scale_changed",), scaled(1.01, later, (0,))),
    "scale off by 0.5 % in one sweep": (DISTURBED, scaled(1.005, sweep_2)),
    "scale off by 1 % in one sweep": (DISTURBED, scaled(0.99, sweep_5)),
    "scale off by 2 % in half a sweep": (DISTURBED, scaled(1.02, half_of_sweep_1)),
    "turned by 1° half-way": (("loose_mounting",), turned(1, later)),
    "turned by 2° half-way": (("loose_mounting",), turned(2, later)),
    "turned by 5° half-way": (("loose_mounting",), turned(5, later)),
    "turned by 10° half-way": (("loose_mounting",), turned(10, later)),
    "turned by 1° in one sweep": (DISTURBED, turned(1, sweep_2)),
    "turned by 2° in one sweep": (DISTURBED, turned(2, sweep_5)),
    "turned by 5° in one sweep": (DISTURBED, turned(5, sweep_2)),
    "turned by 10° in one sweep": (DISTURBED, turned(10, sweep_5)),
    "turned by 2° in half a sweep": (DISTURBED, turned(2, half_of_sweep_1)),
    "bit 12 high in 1 %": (("stuck_bit",), converted(lambda counts: counts | 1 << 12, 0.01)),
    "bit 12 high in 5 %": (("stuck_bit",), converted(lambda counts: counts | 1 << 12, 0.05)),
    "bit 12 low in 5 %": (("stuck_bit",), converted(lambda counts: counts & ~(1 << 12), 0.05)),
    "bit 10 high in 5 %": (("stuck_bit",), converted(lambda counts: counts | 1 << 10, 0.05)),
    "bit 7 high in 10 %": (("stuck_bit", "skewed_noise"), converted(lambda counts: counts | 1 << 7, 0.1)),
    "bit 3 high in 10 %": (("stuck_bit",), converted(lambda counts: counts | 1 << 3, 0.1)),
    "bit 0 always high": (("stuck_bit",), converted(lambda counts: counts | 1)),
    "low byte always 0": (("stuck_bit", "stuck_sensor"), converted(lambda counts: counts & ~0xFF)),
    "low half-byte always 0": (("stuck_bit",), converted(lambda counts: counts & ~0xF)),
    "clips at 0.95 rad/s": (("clipping", "stuck_axis"), clipped(-0.95, 0.95)),
    "clips at 0.85 rad/s": (("clipping", "stuck_axis"), clipped(-0.85, 0.85)),
    "clips at 0.9 rad/s on one side": (("clipping", "stuck_axis"), clipped(-9, 0.9)),
    "wraps at 0.95 rad/s": (("spikes", "wrong_axis", "wrong_sign", "time_base_not_found"), wrapped(0.95)),
    "1 % quadratic": (("cw_against_ccw", "sweeps_against_rests"), curved(lambda felt: 0.01 * felt**2)),
    "0.5 % quadratic": (("cw_against_ccw", "sweeps_against_rests"), curved(lambda felt: 0.005 * felt**2)),
    "1 % asymmetry": (("cw_against_ccw", "sweeps_against_rests"), curved(lambda felt: 0.01 * np.abs(felt))),
    "2 % asymmetry": (("cw_against_ccw", "sweeps_against_rests"), curved(lambda felt: 0.02 * np.maximum(felt, 0))),
    "halves of a sweep swapped": ((), rolled(sweep_2, 0.5)),
    "half a second repeated": (("repeated_readings",), repeated(sweep_2, 0.5)),
    "two seconds repeated": (("repeated_readings",), repeated(sweep_5, 2.0)),
    "spikes in 0.1 %": (("spikes",), spiky(0.001, 1.0)),
    "spikes in 2 %": (("spikes",), spiky(0.02, 2.0)),
    "spikes to one side in 0.5 %": (("spikes",), spiky(0.005, 1.0, one_sided=True)),
    "an axis frozen in a sweep": (("stuck_axis", "stuck_sensor"), frozen(sweep_2, (1,))),
    "an axis frozen in a rest": (("stuck_axis",), frozen(rest_3, (0,))),
    "all axes frozen in a rest": (("stuck_axis", "repeated_readings"), frozen(rest_3, (0, 1, 2))),
    "all axes frozen in a sweep": (("stuck_sensor",), frozen(sweep_5, (0, 1, 2))),
    "times of a sweep 20 ms late": (DISTURBED, late(0.02, sweep_2)),
    "times of a sweep 200 ms late": ((*DISTURBED, "lost_samples"), late(0.2, sweep_2)),
    "zeros in 1 %": (("spikes", "stuck_bit"), replaced(lambda seen: seen.some(0.01), 0)),
    "zeros for a second": (("stuck_sensor",), replaced(lambda seen: seen.second(seen.sweep(2)), 0)),
    "sign wrong in 0.5 %": (("spikes",), converted(lambda counts: -counts, 0.005)),
    "every tenth reading an old one": ((), old(10)),
    "two axes swapped for a second": ((*DISTURBED, "spikes", "skewed_noise"), swapped(sweep_2)),
    "bias steps by 0.005 rad/s half-way": (("residuals",), offset(0.005, lambda seen: seen.late - 0.5)),
    "bias drifts by 0.005 rad/s": (("residuals",), drifting(0.005)),
    "noise of 0.1 rad/s in one sweep": ((), noisier(0.1, sweep_2)),
}
