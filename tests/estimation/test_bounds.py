"""The best that can be done: Cramér–Rao bounds, and whether the six directions of SIX are the best six."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.estimation.design.bounds import (
    efficiency,
    six_observation_bound,
    triaxial_bound,
    vector_bound,
    vector_matrix_bound,
)
from rig.estimation.design.optimality import (
    PARAMETER_COUNT,
    Model,
    g_efficiency,
    list_designs,
    maximum_prediction_variance,
    prediction_variance,
)
from rig.estimation.gyroscope.six_observation_batch import algorithm_1_batch, newton_batch
from rig.estimation.gyroscope.vector_model import solve_vector_batch, solve_vector_model
from rig.estimation.reference.reference_model import KnownNorm, predicted
from rig.estimation.reference.triaxial import solve_triaxial_batch
from rig.study.rate_table import ACCELEROMETER_MATRIX, ACCELEROMETER_REFERENCE_M_S2, ACCELEROMETER_SECOND_ORDER
from support.motions.rate_table import attitudes, noisy

SCALE = np.array([1.1771, 1.1554, 1.1440])
BIAS = np.array([0.0077, -0.0100, -0.0051])
RUNS = 20000
MOUNTING = Rotation.from_rotvec([0.06, -0.05, 0.07]).as_matrix()  # 10 % of misalignment


def minute(speed: float) -> tuple[Array, Array, Array]:
    """Rates in the flange frame (12, 3), variances (12, 3) and RUNS noisy means: six turns and six rests of 3 s."""
    rates = np.concatenate([speed * np.kron(np.eye(3), [[1.0], [-1.0]]).astype(np.float64), np.zeros((6, 3))])
    samples = 200 * np.repeat([2 * np.pi / speed, 3.0], 6)
    variances = np.tile(0.035**2 / samples[:, None], (1, 3))
    return rates, variances, noisy(rates @ MOUNTING.T / SCALE - BIAS, variances, runs=RUNS)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [np.pi / 3, 3.0])
def test_closed_form_and_vector_model_are_efficient(speed: float) -> None:
    rates, variances, means = minute(speed)
    turns = slice(0, 6)
    closed = newton_batch(means[:, turns], np.full(6, speed))
    vector = solve_vector_batch(means, rates, variances)
    of_turns = six_observation_bound(SCALE, rates[turns] @ MOUNTING.T, variances[turns])
    of_all = vector_bound(MOUNTING / SCALE[:, None], rates, variances)
    for found, bound in ((closed, of_turns), (vector, of_all)):
        errors = np.concatenate([found.scale - SCALE, found.bias_rad_s - BIAS], axis=1)
        ratio = efficiency(errors, bound)
        assert np.all((ratio > 0.95) & (ratio < 1.05)), ratio


@pytest.mark.parametrize(("speed", "gain"), [(np.pi / 3, 4.0), (3.0, 7.0)])
def test_known_axes_and_rests_make_the_bias_several_times_better(speed: float, gain: float) -> None:
    rates, variances, means = minute(speed)
    published = algorithm_1_batch(means[:, :6], np.full(6, speed))
    vector = solve_vector_batch(means, rates, variances)
    squared = [np.mean((found.bias_rad_s - BIAS) ** 2) for found in (published, vector)]
    assert squared[0] / squared[1] > gain
    scale = [np.mean((found.scale - SCALE) ** 2) for found in (published, vector)]
    assert scale[0] / scale[1] == pytest.approx(1.0, abs=0.05)


def test_the_vector_models_covariance_is_its_bound() -> None:
    rates, variances, means = minute(1.0)
    solution = solve_vector_model(means[0], rates, variances)
    np.testing.assert_allclose(solution.matrix_covariance, vector_matrix_bound(rates, variances), rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(
        np.diag(solution.covariance), np.diag(vector_bound(solution.matrix, rates, variances)), rtol=1e-9
    )


def test_the_bound_of_six_observations_is_the_theory_of_one_axis() -> None:
    speed, sigma, samples = 3.0, 0.035, 419
    rates = speed * np.kron(np.eye(3), [[1.0], [-1.0]]).astype(np.float64)
    bound = six_observation_bound(SCALE, rates, np.full((6, 3), sigma**2 / samples))
    bias = sigma / np.sqrt(2 * samples)
    np.testing.assert_allclose(np.sqrt(np.diag(bound)), [*SCALE**2 * bias / speed, *[bias] * 3], rtol=1e-12)


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("second_order", [None, ACCELEROMETER_SECOND_ORDER])
def test_maximum_likelihood_reaches_the_triaxial_bound(second_order: Array | None) -> None:
    r, bias = attitudes(14), np.array([0.01, -0.004, 0.009])
    variances = np.full((14, 3), 1e-8) * np.array([1.0, 4.0, 0.25])
    theta = np.concatenate(
        [
            ACCELEROMETER_MATRIX.ravel(),
            ACCELEROMETER_REFERENCE_M_S2,
            bias,
            *([] if second_order is None else [second_order]),
        ]
    )
    draws = noisy(predicted(theta, r, np.zeros((14, 3))), variances, runs=5000)
    found = solve_triaxial_batch(
        draws,
        r,
        variances,
        KnownNorm(float(np.linalg.norm(ACCELEROMETER_REFERENCE_M_S2)), [0, 0, -1]),
        second_order=second_order is not None,
        method="maximum_likelihood",
    )
    bound = triaxial_bound(
        ACCELEROMETER_MATRIX, ACCELEROMETER_REFERENCE_M_S2, bias, r, variances, second_order=second_order
    )
    ratio = efficiency(found - theta, bound)
    assert np.all((ratio > 0.9) & (ratio < 1.1)), ratio


@pytest.mark.parametrize("model", ["squared", "vector"])
def test_the_six_directions_are_g_optimal(model: Model) -> None:
    six = list_designs()["six"]
    assert maximum_prediction_variance(six, model) == pytest.approx(PARAMETER_COUNT[model], abs=1e-6)
    assert g_efficiency(six, model) == pytest.approx(1.0, abs=1e-6)
    # The worst places are the design's own points, as the equivalence theorem wants it.
    np.testing.assert_allclose(prediction_variance(six, six, model), PARAMETER_COUNT[model], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["squared", "vector"])
def test_no_design_is_better_than_the_number_of_parameters(model: Model) -> None:
    rng = np.random.default_rng(1)
    for count in (7, 9, 20):
        directions = rng.normal(size=(count, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        assert maximum_prediction_variance(directions, model) > PARAMETER_COUNT[model]
        assert np.mean(prediction_variance(directions, directions, model)) == pytest.approx(PARAMETER_COUNT[model])


@pytest.mark.slow
def test_other_designs_compare_as_they_should() -> None:
    worst = {name: maximum_prediction_variance(design) for name, design in list_designs().items()}
    assert min(worst, key=lambda name: worst[name]) == "six"
    assert worst["icosahedron"] == pytest.approx(9.0) and worst["six, one direction twice"] == pytest.approx(7.0)
    singular = {name for name, value in worst.items() if np.isinf(value)}
    assert singular == {"tetrahedron", "eight corners", "one direction missing"}  # equal squares, or too few
    known = {name: maximum_prediction_variance(design, "vector") for name, design in list_designs().items()}
    assert known["tetrahedron"] == pytest.approx(4.0) and known["one direction missing"] == pytest.approx(10.0)
