"""Invented results of one sensor and of six, with failed checks, for tests of how runs end."""

from rig.data.result_file import ResultDocument, read_result
from support.paths import RECORDINGS

ONE = read_result(RECORDINGS / "verified")


def make_three_parts() -> ResultDocument:
    """Return three gyroscopes and three accelerometers, with every check of each."""
    one = read_result(RECORDINGS / "imu")
    names = ("lsm9ds1", "mpu9250", "adis16465")
    checks = [
        check.model_copy(update={"sensor": name, "name": check.name.replace("gyro.", f"{name}.")})
        for name in names
        for check in one.checks
    ]
    serials = {name: {"serial_number": f"{name.upper()}-001"} for name in names}
    return one.model_copy(
        update={
            "checks": tuple(checks),
            "gyroscopes": {name: one.gyroscopes["gyro"].model_copy(update=serial) for name, serial in serials.items()},
            "accelerometers": {
                name: one.accelerometers["gyro"].model_copy(update=serial) for name, serial in serials.items()
            },
        }
    )


def fail_checks(result: ResultDocument, *names: str) -> ResultDocument:
    """Return the result with the checks of these names far beyond their limits."""
    checks = [
        check.model_copy(update={"passed": False, "value": 3 * (check.limit or 1)}) if check.name in names else check
        for check in result.checks
    ]
    return result.model_copy(update={"checks": tuple(checks), "verdict": "fail"})
