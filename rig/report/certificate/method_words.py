"""The method paragraph of a certificate (ISO/IEC 17025, 7.8.2.1 f): one function for each kind of motion. Pure."""

from collections.abc import Iterator

from rig.report.certificate.content import Certificate

REPEATED_MOTION = (
    "The movement of a calibration was repeated with readings corrected by the board, together with a reference on "
    "the same board."
)


def method_in_words(certificate: Certificate) -> str:
    """Return sentences on the motion of the items, the reference of their readings, and the procedure."""
    if certificate.by_hand:
        sentences = [_describe_hand(certificate)]
    elif certificate.external:
        sentences = [*_describe_file(certificate)]
    else:
        sentences = [*_describe_turner(certificate)]
    if not certificate.calibrates:
        sentences.append(REPEATED_MOTION)
    described = f"docs/method.md and docs/uncertainty.md of rig {certificate.provenance.rig_version}"
    return " ".join([*sentences, f"Procedure: {described}, {certificate.procedure}."])


def method_in_short(certificate: Certificate) -> str:
    """Return the method in a few words, for the digital certificate."""
    if certificate.by_hand:
        return "by hand: turned on a flat table between rests"
    if certificate.external:
        return "external readings, of a motion stated by a file"
    return certificate.words.briefly.format(turns=certificate.turns)


def _describe_hand(certificate: Certificate) -> str:
    level = " and an accelerometer used as a level" if certificate.levelled else ""
    return (
        "By hand: the item was turned on a flat table and laid on its faces; its own readings show when it was at "
        "rest and when it moved. The integrated rate between rests is compared with whole turns and with the "
        f"vertical before and after, which the faces of the item{level} show; scale factors, biases and axes are "
        "solved for by weighted least squares, together with the standard deviations of the handling errors."
    )


def _describe_file(certificate: Certificate) -> Iterator[str]:
    """Yield sentences on the method for readings whose motion a file states."""
    yield "The readings are external, and a file states the motion of the items during them."
    if certificate.gyroscopes:
        axes = (
            "U contains inclinations of the axes about which the item was turned, as far as its motion does not show "
            "them."
            if _estimators(certificate) == "increments"
            else "The angles between the axes are relative to the directions that the file states, whose constant "
            "errors U does not contain."
        )
        yield (
            "Scale factors, biases and axes of the gyroscope are solved for by weighted least squares "
            f"(estimator: {_estimators(certificate)}). {axes}"
        )
    if certificate.calibrated_at_rest:
        standards = " and ".join(kind.standard.quantity for kind in certificate.calibrated_at_rest)
        attitudes = "; the attitude error of the file is estimated with it" if certificate.finds_attitudes else ""
        yield f"At rest, the readings are compared with {standards} in the axes of the file{attitudes}."


def _describe_turner(certificate: Certificate) -> Iterator[str]:
    """Yield sentences on the method for a turner with joints."""
    if certificate.gyroscopes:
        yield from _describe_sweeps(certificate)
    if stages := certificate.mounted:
        yield (
            f"The item was mounted in {len(stages) + 1} stages. Relative to the first, with U (k = 2): "
            f"{'; '.join(stages)}."
        )
    for kind in certificate.calibrated_at_rest:
        yield kind.standard.method(bool(certificate.gyroscopes))
        if kind.kind == "magnetometer" and certificate.reversals:
            yield "They were turned over between runs, which separates their bias from the arm's field."
    if certificate.result.bias_drift:
        yield ("The same attitudes were repeated; biases by repeat are those with scale, axes and reference fixed.")


def _describe_sweeps(certificate: Certificate) -> Iterator[str]:
    """Yield sentences on the sweeps of gyroscopes: numbers, reference, estimator."""
    counts = "; ".join(
        f"{gyroscope.name}: {len(gyroscope.sensor.observations)} sweeps, {len(gyroscope.sensor.rests)} rests"
        for gyroscope in certificate.gyroscopes
    )
    yield f"{certificate.words.method.format(turns=certificate.turns)} ({counts})."
    fitted = getattr(certificate.gyroscopes[0].sensor.vector_model, "g_sensitivity_rad_s_per_m_s2", None)
    yield (
        f"The mean reading over a turn is compared with {'its angle' if certificate.arcs else '2π'} divided by the "
        f"turn's duration, about an axis known from {certificate.words.directions}; scale factors, biases, "
        f"axes{'' if fitted is None else ' and g-sensitivity'} are solved for by weighted least squares "
        f"(estimator: {_estimators(certificate)})."
    )


def _estimators(certificate: Certificate) -> str:
    return ", ".join(dict.fromkeys(gyroscope.sensor.estimator for gyroscope in certificate.gyroscopes))
