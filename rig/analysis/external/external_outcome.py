"""The analysis of external recordings for `rig.analysis.analyses`: solved and judged."""

from collections.abc import Sequence

from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.analysis.external.external_recordings import check_external, solve_external
from rig.analysis.outcome import Outcome, origin_of
from rig.data.quantity import RATE
from rig.data.recording.motion_file import ExternalReadings
from rig.data.recording.run_data import RunData


def calibrate_external(runs: Sequence[RunData], external: ExternalReadings, estimator: str) -> Outcome:
    """Return the outcome of readings whose motion a file describes.

    The default `estimator` stands for the configured one. Raise as `solve_external` does.
    """
    settings, name = runs[0].settings, external.item.name
    configured = None if settings.elsewhere is None else settings.elsewhere.estimator
    solved = solve_external(external, settings, configured if estimator == DEFAULT_ESTIMATOR else estimator)
    return Outcome(
        settings=settings,
        provenance=origin_of(runs),
        checks=(*check_external(name, solved), *(check for kind in solved.installed_kinds for check in kind.checks)),
        results={} if solved.gyroscope is None else {name: solved.gyroscope},
        external={name: solved},
        installed_kinds=solved.installed_kinds,
        polynomials={} if solved.polynomials is None else {name: {RATE: solved.polynomials}},
    )
