"""Mean squared error of every estimator over its Cramér–Rao bound, all gyroscope estimators on the same runs.

python benchmarks/solving/efficiency.py     # 30 gyroscopes × 200 runs; `rig study estimators` does 500 and plots them
"""

from rig.study.estimators import study
from rig.study.study_report import Settings


def main() -> None:
    """Print the ratios."""
    for finding in study(Settings(runs=200)).findings:
        print(f"{finding.quantity:75}{finding.value:8.3f}")


if __name__ == "__main__":
    main()
