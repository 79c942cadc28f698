"""Coverage of the stated uncertainty: sessions with all effects in the budget, drawn from their distributions.

As in JCGM 101, a draw is a session with its own gyroscope, arm and controller. The session's mean readings are computed
from the true motion, whereas the solver gets the controller's values. The interval ± 2 u of the budget must then cover
the truth in 95 of 100 draws. For comparison the solver also runs without this rig's remedies: no gravity columns, no
bias random walk, no correction of the clock, and an uncertainty from noise alone.
"""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import UnknownErrors, budget
from rig.estimation.gyroscope.nonlinearity import CUBE_DEVIATION, SQUARE_DEVIATION
from rig.estimation.gyroscope.own_errors import SensorProperties
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.gyroscope.vector_fit import VectorInputs, centripetal_m_s2, explain
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.estimation.statistics.bias_process import flicker_covariance
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS, BATCHES = 1500, 30
REST_S = 2.6
# Lever arms of the flange's centre from wrists 3, 1 and 2: offsets d5 and d6 of a UR10e (maker's article 45257).
LEVER_ARMS_M = np.array([[0.0, 0.0, 0.0], [0.11985, 0.0, 0.11655], [0.0, 0.0, 0.11655]])
STEP_S = 0.05  # step of the bias random walk
ATTITUDES = 72  # attitudes per revolution
MOUNTING_RAD, SKEW_RAD = np.radians(5.0), np.radians(0.25)
SAMPLE_RATE_HZ = 238.0
WARM_UP_S, STEP_K = 300.0, 1 / 16  # duration of warm-up; resolution of an LSM9DS1's thermometer: DocID025715, table 4


@dataclass(frozen=True, slots=True)
class Effects:
    """Magnitudes of the effects: half-widths of clock, offset, nonlinearity and warming, standard deviations of others.

    - `g_sensitivity_rad_s_g`: every element of the g-sensitivity; `axis_rad`: twist of each wrist's axis; `jitter_s`:
      jitter of the states' times.
    - `clock`, `clock_known`: error of the controller's clock, and standard uncertainty of its correction.
    - `walk_rad_s_sqrt_s`: bias random walk; `offset_m`: the sensor's offset from the flange's centre, by axis.
    - `nonlinearity`: as a fraction of full scale; `warming_k`: change of temperature, which affects bias and scale.

    The default noise is that of an LSM9DS1 by its data sheet, 0.01 °/s/√Hz, the nonlinearity that of an MPU-9250
    (PS-MPU-9250A-01).
    """

    speed_rad_s: float = np.pi / 3
    noise_rad_s: float = 0.002
    g_sensitivity_rad_s_g: float = float(np.radians(0.1))
    axis_rad: float = 6e-4
    clock: float = 50e-6
    clock_known: float = 1e-6
    jitter_s: float = 100e-6
    walk_rad_s_sqrt_s: float = 3e-5
    offset_m: float = 0.05
    latitude_deg: float = 48.0
    nonlinearity: float = 1e-3
    full_scale_rad_s: float = float(np.radians(245))
    warming_k: float = 0.3
    bias_rad_s_per_k: float = 5e-4
    scale_per_k: float = 6e-4
    instability_rad_s: float = 4.8e-5  # 10 °/h


@dataclass(frozen=True, slots=True)
class Session:
    """The arm's motion in N windows.

    There are 72 attitudes in each window (N, 72, 3, 3), from the base's frame to the flange's. Rates (N, 3) and lever
    arms (N, 3) are in the flange's frame.
    """

    attitudes: Array
    rates_rad_s: Array
    arms_m: Array
    windows_s: Array
    joints: tuple[str | None, ...]


def study(settings: Settings) -> StudyReport:
    """Find the coverage of ± 2 u, and the RMS of error over u, with and without the rig's remedies (see the module)."""
    ratios = errors(Effects(), settings)
    rows = [
        {
            "parameter": parameter,
            "remedies": remedies,
            "coverage_percent": 100 * float(np.mean(np.abs(ratios[:, variant, p]) < 2)),
            "rms_error_over_u": float(np.sqrt(np.mean(ratios[:, variant, p] ** 2))),
        }
        for variant, remedies in enumerate(("with", "without"))
        for p, parameter in enumerate(PARAMETERS)
    ]
    return StudyReport(table(rows), _findings(rows), partial(_draw, rows), (8.0, 4.5))


def errors(effects: Effects, settings: Settings) -> Array:
    """Return errors (draws, 2, 6) of scale and bias, divided by their standard uncertainty.

    Of the two, the first is with the rig's remedies, which the module lists, and the second without them.
    """
    draws = settings.runs or DRAWS
    counts = [draws // BATCHES + (batch < draws % BATCHES) for batch in range(BATCHES)]
    return np.concatenate(run_parallel(partial(_simulate_batch, effects), [n for n in counts if n], settings))


def _simulate_batch(effects: Effects, rng: np.random.Generator, draws: int) -> Array:
    return np.array([_simulate_session(effects, rng) for _ in range(draws)])


def _simulate_session(effects: Effects, rng: np.random.Generator) -> Array:
    """Simulate a session with randomly drawn effects; return its ratios (2, 6) of error to uncertainty, as `errors`.

    The mean readings are

        m = K⁻¹ A ω − b + G f + drift + noise

    with the scale factors K, the axes A, the true rates ω, the bias b, and the effect G f of gravity. The solver gets
    the nominal motion, with rates by the controller's wrong clock.
    """
    # The true motion, and the readings of a sensor with all effects.
    scale, bias = rng.uniform(0.9, 1.1, 3), rng.uniform(-0.02, 0.02, 3)
    true = _build_session(rng.normal(0, effects.axis_rad, (3, 2)), effects.speed_rad_s)
    nominal = _build_session(np.zeros((3, 2)), effects.speed_rad_s)
    drift, mean_drift = _draw_random_walk(rng, true.windows_s, effects.walk_rad_s_sqrt_s)
    flicker = effects.instability_rad_s**2 * flicker_covariance(true.windows_s)
    drift = drift + rng.multivariate_normal(np.zeros(len(flicker)), flicker, 3).T
    axes = _draw_axes(rng) @ _draw_rotation(rng, MOUNTING_RAD)
    heading, latitude = rng.uniform(0, 2 * np.pi), np.radians(effects.latitude_deg)
    earth = EARTH_RATE_RAD_S * np.array(
        [np.cos(latitude) * np.cos(heading), np.cos(latitude) * np.sin(heading), np.sin(latitude)]
    )
    up = np.array([0.0, 0.0, 1.0])
    sensitivity = rng.normal(0, effects.g_sensitivity_rad_s_g, (3, 3))  # sensitivity of the axes to specific force
    attitudes = true.attitudes.mean(axis=1)
    lever_arms_m = true.arms_m + rng.uniform(-effects.offset_m, effects.offset_m, 3)
    force = attitudes @ up + centripetal_m_s2(true.rates_rad_s, lever_arms_m) / STANDARD_GRAVITY_M_S2
    g_bias = force @ axes.T @ sensitivity.T
    rates = true.rates_rad_s + attitudes @ earth
    durations = np.diff(true.windows_s).T[0]
    variances = np.tile(effects.noise_rad_s**2 / (SAMPLE_RATE_HZ * durations)[:, None], 3)
    noise = np.sqrt(variances) * rng.standard_normal((len(durations), 3))
    warmth, recorded_k = _draw_warming(rng, effects, true)
    bias_slope, scale_slope = (size * rng.uniform(-1, 1, 3) for size in (effects.bias_rad_s_per_k, effects.scale_per_k))
    drift = drift + (warmth - np.average(warmth, weights=durations))[:, None] * bias_slope
    sweeps = durations * true.rates_rad_s.any(axis=1)
    sensed = _apply_nonlinearity(rates @ axes.T, effects, rng) * (
        1 + (warmth - np.average(warmth, weights=sweeps))[:, None] * scale_slope
    )
    means = sensed / scale - bias + g_bias + drift + noise
    # The motion that the controller reports, and what the solver knows about the effects.
    clock = rng.uniform(-effects.clock, effects.clock)
    jitter = rng.normal(0, np.sqrt(2) * effects.jitter_s, len(durations)) / durations
    reported = nominal.rates_rad_s * (1 - clock + jitter)[:, None]
    truth = np.concatenate([scale, bias - mean_drift])  # the reading is −b + drift, so the drift lowers the bias
    corrected = reported * (1 + clock + rng.normal(0, effects.clock_known))
    inputs = VectorInputs(
        means_rad_s=means,
        variances_rad2_s2=variances,
        turns_rad_s=corrected,
        earth_rate_rad_s=np.zeros(3),
        speed_std_rad_s=np.zeros(len(durations)),
        attitudes=nominal.attitudes.mean(axis=1),
        gravity_m_s2=nominal.attitudes.mean(axis=1) @ (-STANDARD_GRAVITY_M_S2 * up),
        windows_s=nominal.windows_s,
        joints=nominal.joints,
        arms_m=nominal.arms_m,
        sensor=SensorProperties(
            nonlinearity=effects.nonlinearity,
            full_scale_rad_s=effects.full_scale_rad_s,
            bias_rad_s_per_k=effects.bias_rad_s_per_k,
            scale_per_k=effects.scale_per_k,
            instability_rad_s=effects.instability_rad_s,
            temperature_c=recorded_k,
            temperature_step_k=STEP_K,
        ),
    )
    fit = explain(inputs, np.eye(3))
    unknown = UnknownErrors(
        clock_std=effects.clock_known,
        clock_source="",
        state_jitter_s=effects.jitter_s,
        axis_rad=effects.axis_rad * np.sqrt(3),
        sensor_offset_m=effects.offset_m,
        g_sensitivity_rad_s_per_g=effects.g_sensitivity_rad_s_g,
        earth_rate=True,
    )
    solved, plain = fit.solution, solve_vector_model(means, reported, variances)
    with_all = (np.concatenate([solved.scale, solved.bias_rad_s]) - truth) / budget(fit, unknown).std
    without = (np.concatenate([plain.scale, plain.bias_rad_s]) - truth) / np.sqrt(np.diag(plain.covariance))
    return np.array([with_all, without])


def _apply_nonlinearity(along_rad_s: Array, effects: Effects, rng: np.random.Generator) -> Array:
    """Return the rates (N, 3) that a nonlinear sensor indicates; at the sweeps' speed they are exact."""
    cube, square = effects.nonlinearity / np.array([[CUBE_DEVIATION], [SQUARE_DEVIATION]]) * rng.uniform(-1, 1, (2, 3))
    fraction, sweep_fraction = along_rad_s / effects.full_scale_rad_s, effects.speed_rad_s / effects.full_scale_rad_s
    curve = cube * (fraction**2 - sweep_fraction**2) + square * fraction
    return np.asarray(along_rad_s * (1 + curve), dtype=np.float64)


def _draw_warming(rng: np.random.Generator, effects: Effects, session: Session) -> tuple[Array, Array]:
    """Return the drawn warming (N,), K, of the sensor from the start to each window, and the same, rounded."""
    middle_s = session.windows_s.mean(axis=1)
    warmth = effects.warming_k * rng.uniform(-1, 1) * (1 - np.exp(-middle_s / WARM_UP_S))
    return warmth, STEP_K * np.round(warmth / STEP_K)


def _build_session(twists: Array, speed_rad_s: float) -> Session:
    """Return two sweeps each of wrists 3, 1 and 2, about the flange's z, y and x, and a rest after every sweep.

    The arrays list the six sweeps first, then the rests. `twists` (3, 2) tilt the wrists' axes in the flange's frame;
    each axis is fixed in this frame while its wrist turns. At home the flange's x, y and z point forward, left and up
    in the base.
    """
    attitudes = []
    rates = []
    arms = []
    rest_attitudes = []
    windows = []
    rests = []
    start_s, sweep_s = 0.0, 2 * np.pi / speed_rad_s
    turn = np.linspace(-np.pi, np.pi, ATTITUDES, endpoint=False) + np.pi / ATTITUDES
    for number, joint in enumerate((2, 1, 0)):
        axis = np.eye(3)[joint].copy()
        axis[(joint + 1) % 3], axis[(joint + 2) % 3] = twists[number]
        axis /= np.linalg.norm(axis)
        for sign in (-1.0, 1.0):
            attitudes.append(_rotate(axis, -turn))
            rates.append(sign * speed_rad_s * axis)
            arms.append(LEVER_ARMS_M[number])
            windows.append((start_s, start_s + sweep_s))
            rest_attitudes.append(np.repeat(_rotate(axis, np.array([-sign * np.radians(190)])), ATTITUDES, axis=0))
            rests.append((start_s + sweep_s + 0.4, start_s + sweep_s + 0.4 + REST_S))
            start_s += sweep_s + 3.6
        start_s += 2.0
    return Session(
        np.array([*attitudes, *rest_attitudes]),
        np.array([*rates, *np.zeros((6, 3))]),
        np.array([*arms, *np.zeros((6, 3))]),
        np.array([*windows, *rests]),
        ("wrist_3", "wrist_3", "wrist_1", "wrist_1", "wrist_2", "wrist_2", *[None] * 6),
    )


def _rotate(axis: Array, angles_rad: Array) -> Array:
    """Return rotations (n, 3, 3) about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sin, cos = np.sin(angles_rad)[:, None, None], np.cos(angles_rad)[:, None, None]
    rotations: Array = np.eye(3) + sin * cross + (1 - cos) * (cross @ cross)
    return rotations


def _draw_rotation(rng: np.random.Generator, angle_rad: float) -> Array:
    axis = rng.normal(size=3)
    rotation: Array = _rotate(axis / np.linalg.norm(axis), np.array([angle_rad]))[0]
    return rotation


def _draw_axes(rng: np.random.Generator) -> Array:
    """Draw unit axes as rows (3, 3), non-orthogonal by some tenths of a degree."""
    axes = np.eye(3) + np.tril(rng.normal(0, SKEW_RAD, (3, 3)), -1)
    unit: Array = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return unit


def _draw_random_walk(rng: np.random.Generator, windows_s: Array, rate: float) -> tuple[Array, Array]:
    """Return the means (N, 3) of a random walk over the windows, and its mean (3,) over the whole time."""
    times_s = np.arange(windows_s.min(), windows_s.max(), STEP_S)
    walk = np.cumsum(rate * np.sqrt(STEP_S) * rng.standard_normal((len(times_s), 3)), axis=0)
    inside = (times_s >= windows_s[:, :1]) & (times_s < windows_s[:, 1:])
    return np.array([walk[mask].mean(axis=0) for mask in inside]), walk.mean(axis=0)


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    return tuple(
        StudyFinding(f"± 2 u covers {row['parameter']}, {row['remedies']} the remedies", row["coverage_percent"], "%")
        for row in rows
    )


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panel = figure.subplots()
    for offset, remedies in ((-0.2, "with"), (0.2, "without")):
        covered = [row["coverage_percent"] for row in rows if row["remedies"] == remedies]
        panel.bar(np.arange(len(PARAMETERS)) + offset, covered, 0.4, label=f"{remedies} the remedies")
    panel.axhline(95.45, color="black", linestyle="--", linewidth=0.8)
    panel.set_xticks(range(len(PARAMETERS)), PARAMETERS)
    panel.set(ylabel="sessions whose true value is within ± 2 u, %", ylim=(0, 100))
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
