"""A sweep and the rest after it, there and back, by the plan of the demonstration."""

from pathlib import Path

import numpy as np
from svg import Drawing, Point

from rig.config.load import load
from rig.procedure import Rest, SixSweepsSection, Sweep, plan_six_observation

DEMO = Path(__file__).parents[2] / "configs" / "demo.yaml"
BLUE, SHADE, REST = "#1565c0", "#dbe8f6", "#f3ead7"


def sweep() -> Drawing:
    """The joint's speed over time: ramp, one revolution, ramp, rest; and the same back."""
    config = load(DEMO).config
    assert isinstance(config.procedure, SixSweepsSection)
    steps = plan_six_observation(config.arm, config.procedure).steps
    out, back = [step for step in steps if isinstance(step, Sweep)][:2]
    rest_s = next(step.duration_s for step in steps if isinstance(step, Rest))
    ramp_s, turn_s = out.speed_rad_s / out.acceleration_rad_s2, 2 * np.pi / out.speed_rad_s
    before_s = (out.duration_s - turn_s) / 2  # ramp and margin
    speed = np.degrees(out.speed_rad_s)
    left, per_s, zero, high = 110.0, 42.0, 230.0, 110.0
    drawing = Drawing(960, 430, "A sweep, a rest, and back")
    drawing.words(
        (480, 30), f"one wrist: a sweep, a rest, and back, at {speed:g} °/s", size=18, anchor="middle", bold=True
    )

    def at(time_s: float, sign: float) -> Point:
        return left + per_s * time_s, zero - high * sign

    start = 0.0
    for leg, sign in ((out, 1.0), (back, -1.0)):
        begin, end = start + before_s, start + before_s + turn_s
        drawing.shape([at(begin, 0), at(end, 0), at(end, sign), at(begin, sign)], SHADE, SHADE)
        middle = at((begin + end) / 2, sign / 2)
        drawing.words((middle[0], middle[1] - 8), "one revolution, 360°", anchor="middle", bold=True)
        drawing.words((middle[0], middle[1] + 12), "all readings here are averaged", anchor="middle")
        drawing.words((middle[0], middle[1] + 30), f"mean speed 2π/T, T = {turn_s:g} s", anchor="middle")
        resting = (start + leg.duration_s, start + leg.duration_s + rest_s)
        drawing.shape(
            [at(resting[0], 0.22), at(resting[1], 0.22), at(resting[1], -0.22), at(resting[0], -0.22)], REST, REST
        )
        line = [at(start, 0), at(start + ramp_s, sign), at(start + leg.duration_s - ramp_s, sign), at(resting[0], 0)]
        drawing.line([*line, at(resting[1], 0)], BLUE, 3)
        drawing.words((at(sum(resting) / 2, 0)[0], zero - 34), f"rest, {rest_s:g} s", anchor="middle", bold=True)
        drawing.words((at(sum(resting) / 2, 0)[0], zero + 44), "shows the bias", anchor="middle")
        drawing.words((at(start, 0)[0] + 4, zero + (18 if sign > 0 else -8)), "ramp", size=12)
        start = resting[1]
    drawing.arrow((left - 20, zero), (left + per_s * start + 40, zero), "#777777", 1.5)
    drawing.arrow((left - 20, zero + high + 30), (left - 20, zero - high - 50), "#777777", 1.5)
    drawing.words((left - 26, zero - high + 5), f"+{speed:g}", anchor="end")
    drawing.words((left - 26, zero + 5), "0", anchor="end")
    drawing.words((left - 26, zero + high + 5), f"−{speed:g}", anchor="end")
    drawing.words((left - 10, zero - high - 40), "speed of the joint, °/s", "#555555")
    drawing.words((left + per_s * start + 40, zero + 22), "time", "#555555", anchor="end")
    notes = (
        "The ramps lie outside the revolution. "
        "Three wrists, each there and back: six sweeps, six rests, about a minute."
    )
    drawing.words((480, 410), notes, anchor="middle")
    return drawing
