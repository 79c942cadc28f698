"""What a laboratory does with a part: calibrate it; if it passed, write its digital certificate and PX4's parameters.

python examples/laboratory.py CONFIG NEW_FOLDER
"""

import sys

import rig

STATED = {"certificate.customer": "Example Ltd", "site.country": "DE"}  # on each certificate


def main(config: str, folder: str, *, agreed: bool) -> int:
    """Return 0 if the part passed, else 1; the operator is asked before the arm moves, unless that is `agreed`."""
    run = rig.run(config, out=folder, yes=agreed)
    result = rig.load_result(run.path)
    if result.verdict != "pass":
        failed = ", ".join(check.name for check in result.checks if not check.passed)
        print(f"not passed: {failed}")
        return 1
    files = [*rig.write_certificate(run, STATED, dcc=True), *rig.export(run, "px4")]
    print(f"passed: {', '.join(file.name for file in files)}")
    return 0


if __name__ == "__main__":  # the arm's process reads this file too
    raise SystemExit(main(sys.argv[1], sys.argv[2], agreed="--yes" in sys.argv[3:]))
