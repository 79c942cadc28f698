"""The paragraph of a certificate on method: one function for each kind of motion. ISO/IEC 17025, 7.8.2.1 f. Pure."""

from collections.abc import Iterator

from rig.report.certificate.content import Certificate

REPEATED = (
    "The movement of a calibration was repeated with readings that the board corrects, beside a reference on the same "
    "board."
)


def method_in_words(certificate: Certificate) -> str:
    """Return how the items were moved and what their readings were compared with, then the procedure."""
    if certificate.by_hand:
        sentences = [_turned_by_hand(certificate)]
    elif certificate.elsewhere:
        sentences = [*_moved_as_a_file_states(certificate)]
    else:
        sentences = [*_moved_by_a_turner(certificate)]
    if not certificate.calibrates:
        sentences.append(REPEATED)
    described = f"docs/method.md and docs/uncertainty.md of rig {certificate.provenance.rig_version}"
    return " ".join([*sentences, f"Procedure: {described}, {certificate.procedure}."])


def method_in_short(certificate: Certificate) -> str:
    """Return the same in a few words, for the digital certificate."""
    if certificate.by_hand:
        return "by hand: turned on a flat table between rests"
    if certificate.elsewhere:
        return "readings recorded elsewhere, of a motion that a file tells"
    return certificate.words.briefly.format(turns=certificate.turns)


def _turned_by_hand(certificate: Certificate) -> str:
    level = " and an accelerometer used as a level" if certificate.levelled else ""
    return (
        "By hand: the item was turned on a flat table and laid down on its faces, and its own readings tell when it "
        "lay and when it moved. What the gyroscope turned between rests, integrated, is held against whole turns, and "
        f"against the vertical before and after, by the faces of the item{level}; scale factors, biases and axes are "
        "solved for by weighted least squares, with the sizes of the hand's errors."
    )


def _moved_as_a_file_states(certificate: Certificate) -> Iterator[str]:
    yield "The readings were recorded elsewhere, and a file states how the items moved at that time."
    if certificate.gyroscopes:
        yield (
            "Of the gyroscope scale factors, biases and axes are solved for by weighted least squares "
            f"(estimator: {_estimators(certificate)})."
        )
    if certificate.held_still:
        known = " and ".join(kind.standard.known for kind in certificate.held_still)
        attitudes = "; the file's error of attitude is found with it" if certificate.finds_attitudes else ""
        yield f"Where the items lay still, {known} in the axes of the file is what was to be read{attitudes}."


def _moved_by_a_turner(certificate: Certificate) -> Iterator[str]:
    if certificate.gyroscopes:
        yield from _sweeps(certificate)
    if stages := certificate.mounted:
        yield (
            f"The item was mounted in {len(stages) + 1} stages. Against the first it was found, with U (k = 2): "
            f"{'; '.join(stages)}."
        )
    for kind in certificate.held_still:
        yield kind.standard.method(bool(certificate.gyroscopes))
        if kind.kind == "magnetometer" and certificate.reversals:
            yield "They were turned over between runs, which separates their own bias from the arm's field."
    if certificate.result.bias_drift:
        yield (
            "The same attitudes were gone through again and again; biases by repeat are those with scale, axes and "
            "reference held."
        )


def _sweeps(certificate: Certificate) -> Iterator[str]:
    counts = "; ".join(
        f"{each.name}: {len(each.sensor.observations)} sweeps, {len(each.sensor.rests)} rests"
        for each in certificate.gyroscopes
    )
    yield f"{certificate.words.method.format(turns=certificate.turns)} ({counts})."
    fitted = getattr(certificate.gyroscopes[0].sensor.vector_model, "g_sensitivity_rad_s_per_m_s2", None)
    yield (
        f"The mean reading over a turn stands against {'its angle' if certificate.arcs else '2π'} over the turn's "
        f"duration about an axis known from {certificate.words.directions}; scale factors, biases, "
        f"axes{'' if fitted is None else ' and g-sensitivity'} are solved for by weighted least squares "
        f"(estimator: {_estimators(certificate)})."
    )


def _estimators(certificate: Certificate) -> str:
    return ", ".join(dict.fromkeys(each.sensor.estimator for each in certificate.gyroscopes))
