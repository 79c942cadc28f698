"""Documents of `result.json` for tests, made from those of a verified run."""

from collections.abc import Mapping

from rig.data.result_file import GyroscopeEntry, ResultDocument, read_result
from support.paths import RECORDINGS

VERIFIED = read_result(RECORDINGS / "verified")
SENSOR, REFERENCE = VERIFIED.gyroscopes["gyro"], VERIFIED.gyroscopes["reference"]


def result_document(sensors: Mapping[str, GyroscopeEntry], *, passed: bool = True) -> ResultDocument:
    """Return a result of these sensors whose last check passed or failed."""
    last = VERIFIED.checks[-1].model_copy(update={"passed": passed})
    return VERIFIED.model_copy(
        update={
            "verdict": "pass" if passed else "fail",
            "checks": (*VERIFIED.checks[:-1], last),
            "gyroscopes": dict(sensors),
        }
    )


def remove_budget(document: ResultDocument) -> ResultDocument:
    """Return the result of an estimator that has no uncertainty budget."""
    nothing: dict[str, None] = {"covariance_combined": None, "budget": None}
    gyroscopes = {name: gyroscope.model_copy(update=nothing) for name, gyroscope in document.gyroscopes.items()}
    return document.model_copy(update={"gyroscopes": gyroscopes})
