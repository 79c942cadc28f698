"""What readings recorded elsewhere amount to: they are solved and judged here for `rig.analysis.analyses`."""

from collections.abc import Sequence

from rig.analysis.estimators import DEFAULT_ESTIMATOR
from rig.analysis.external.elsewhere import checks_elsewhere, solved_elsewhere
from rig.analysis.outcome import Outcome, origin_of
from rig.data.quantity import RATE
from rig.data.recording.motion_file import ReadElsewhere
from rig.data.recording.run_file import RunData


def calibrate_external(runs: Sequence[RunData], external: ReadElsewhere, estimator: str) -> Outcome:
    """Solve and judge readings whose motion a file tells; the default estimator stands for the one that was asked for.

    Raises as `solved_elsewhere` does.
    """
    settings, name = runs[0].settings, external.item.name
    asked = None if settings.elsewhere is None else settings.elsewhere.estimator
    solved = solved_elsewhere(external, settings, asked if estimator == DEFAULT_ESTIMATOR else estimator)
    return Outcome(
        settings=settings,
        provenance=origin_of(runs),
        checks=(*checks_elsewhere(name, solved), *(check for kind in solved.of_kinds for check in kind.checks)),
        results={} if solved.gyroscope is None else {name: solved.gyroscope},
        elsewhere={name: solved},
        of_kinds=solved.of_kinds,
        polynomials={} if solved.polynomials is None else {name: {RATE: solved.polynomials}},
    )
