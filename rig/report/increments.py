"""What a gyroscope's increments gave beside matrix and bias, in words and for machines."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rig.analysis.increments import InIncrements
from rig.errors import Fault

MODEL = "ω_m = F (Rᵀ ω_E + ω) + b, integrated between attitudes"


def increment_lines(found: InIncrements) -> Iterator[str]:
    """What stands below the table."""
    solution = found.solution
    if isinstance(solution.earth, Fault):
        yield f"Earth's rate: {solution.earth}; its size, whichever way it points, is in the uncertainty"
    else:
        rate = " ".join(f"{each:+.6g}" for each in solution.earth.rate_rad_s)
        yield f"Earth's rate in table coordinates: {rate} rad/s"
    yield (
        f"increments: {len(solution.residuals_rad)} between attitudes, means over windows of {found.window_s:.3g} s; "
        f"condition {solution.condition:.1f}, residuals {1e3 * _rms(solution.residuals_rad):.3g} mrad"
    )
    yield (
        f"found beside: attitudes off by {1e3 * solution.fix_std_rad:.2g} mrad a window, angle random walk "
        f"{solution.random_walk_rad_sqrt_s:.2g} rad/√s; from one stretch of the recording to another F differs by "
        f"{solution.matrix_scatter:.1e}, b by {solution.bias_scatter_rad_s:.1e} rad/s"
    )
    late_ms, known_ms = 1e3 * solution.clock_s, 2e3 * solution.clock_std_s
    yield f"the attitudes' clock is {late_ms:+.2f} ± {known_ms:.2g} ms off the samples', which is allowed for"
    yield from (
        f"left out: {each.name}: {each.count} increments, the first at {each.first_s:.2f} s" for each in found.left_out
    )
    if solution.set_aside:
        yield f"left out: attitude_untrustworthy: {solution.set_aside} increments that contradict all others"


def increment_entry(found: InIncrements) -> dict[str, Any]:
    """What rotation increments tell, for machines, beside matrix, scale, bias and covariance."""
    solution, earth = found.solution, found.solution.earth
    return {
        "estimator": "increments",
        "reference_table": None if isinstance(earth, Fault) else earth.rate_rad_s.tolist(),
        "reference_error": str(earth) if isinstance(earth, Fault) else None,
        "second_order": None,
        "window_s": found.window_s,
        "clock_s": solution.clock_s,
        "clock_std_s": solution.clock_std_s,
        "fix_std_rad": solution.fix_std_rad,
        "random_walk_rad_sqrt_s": solution.random_walk_rad_sqrt_s,
        "matrix_scatter": solution.matrix_scatter,
        "bias_scatter_rad_s": solution.bias_scatter_rad_s,
        "observations_used": len(solution.residuals_rad),
        "condition": solution.condition,
        "residual_rms_rad": _rms(solution.residuals_rad),
        "left_out": [{"error": each.name, "count": each.count, "first_s": each.first_s} for each in found.left_out],
        "set_aside": solution.set_aside,
    }


def _rms(values: np.typing.NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
