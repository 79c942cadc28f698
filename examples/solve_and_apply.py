"""Solve a recorded run, and correct the run's own readings by the calibration.

python examples/solve_and_apply.py RUN
"""

import sys

import numpy as np

import rig


def main(folder: str) -> None:
    """Print scale factors, biases and their U, then what the sensors read at the end, corrected."""
    run = rig.load(folder)
    result = rig.solve(run)
    print(f"verdict: {result.verdict}")
    for name, calibration in result.items():
        print(f"{name}: scale {calibration.scale} ± {calibration.scale_expanded}")
        print(f"{name}: bias {calibration.bias} ± {calibration.bias_expanded} {calibration.quantity.unit}")
    for name, gyroscope in run.items():
        corrected_rad_s = result[name].apply(gyroscope.rate.values[-100:])
        print(f"{name}: at the end {np.mean(corrected_rad_s, axis=0)} rad/s")


if __name__ == "__main__":
    main(sys.argv[1])
