"""Whether the stated uncertainty holds: sessions in which everything that may be wrong is, drawn from its distribution.

JCGM 101: a draw is a session with a gyroscope, an arm and a controller of its own. Its mean readings are computed from
the true movement, what the solver is given is what the controller would say. The interval ± 2 u of the budget must then
cover the truth in 95 of 100 draws. Beside it stands the solver without what this rig has against each effect: no
gravity columns, no wandering bias, the clock taken for true, and the noise alone for uncertainty.
"""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import Unknown, budget
from rig.estimation.gyroscope.nonlinearity import CUBE_MISSED, SQUARE_MISSED
from rig.estimation.gyroscope.own_errors import KnownSensor
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.gyroscope.vector_fit import Seen, centripetal_m_s2, explain
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.estimation.statistics.bias_process import flicker_covariance
from rig.study.report import Finding, Report, Settings, table
from rig.study.work import in_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS, BATCHES = 1500, 30
REST_S = 2.6
# How far wrists 3, 1 and 2 swing the flange's centre: offsets d5 and d6 of a UR10e (maker's article 45257).
ARMS_M = np.array([[0.0, 0.0, 0.0], [0.11985, 0.0, 0.11655], [0.0, 0.0, 0.11655]])
STEP_S = 0.05  # of the bias's walk
ATTITUDES = 72  # of a turn
MOUNTING_RAD, SKEW_RAD = np.radians(5.0), np.radians(0.25)
SAMPLE_RATE_HZ = 238.0
WARM_UP_S, STEP_K = 300.0, 1 / 16  # of the thermometer of a LSM9DS1: DocID025715, table 4


@dataclass(frozen=True, slots=True)
class Effects:
    """How large what may be wrong is drawn: standard deviations, but for half-widths of the clock and the offset.

    g-sensitivity for every element, rad/s/g; twist of each wrist's axis; jitter of the states' times; walk of the bias;
    how far from the flange's centre the sensor sits along each axis. Half-widths, too, are odd and even nonlinearity as
    a share of full scale, by how much the sensor warms, and what that does to bias and scale. The noise is that of a
    LSM9DS1 by its data sheet, 0.01 °/s/√Hz, the nonlinearity that of a MPU-9250 (PS-MPU-9250A-01, table 1).
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
    """The arm's movement: attitudes (N, 72, 3, 3) from base to flange, in the flange rates (N, 3) and arms (N, 3)."""

    attitudes: Array
    rates_rad_s: Array
    arms_m: Array
    windows_s: Array
    joints: tuple[str | None, ...]


def study(settings: Settings) -> Report:
    """Coverage of ± 2 u, and RMS of error over standard uncertainty, with and without the remedies."""
    drawn = errors(Effects(), settings)
    rows = [
        {
            "parameter": parameter,
            "remedies": remedies,
            "coverage_percent": 100 * float(np.mean(np.abs(drawn[:, which, p]) < 2)),
            "rms_error_over_u": float(np.sqrt(np.mean(drawn[:, which, p] ** 2))),
        }
        for which, remedies in enumerate(("with", "without"))
        for p, parameter in enumerate(PARAMETERS)
    ]
    return Report(table(rows), _findings(rows), partial(_draw, rows), (8.0, 4.5))


def errors(effects: Effects, settings: Settings) -> Array:
    """(draws, 2, 6) errors of scale and bias over their standard uncertainties, with and without the remedies."""
    draws = settings.runs or DRAWS
    shares = [draws // BATCHES + (batch < draws % BATCHES) for batch in range(BATCHES)]
    return np.concatenate(in_parallel(partial(_batch, effects), [share for share in shares if share], settings))


def _batch(effects: Effects, rng: np.random.Generator, draws: int) -> Array:
    return np.array([_one(effects, rng) for _ in range(draws)])


def _one(effects: Effects, rng: np.random.Generator) -> Array:
    scale, bias = rng.uniform(0.9, 1.1, 3), rng.uniform(-0.02, 0.02, 3)
    true = _session(rng.normal(0, effects.axis_rad, (3, 2)), effects.speed_rad_s)
    told = _session(np.zeros((3, 2)), effects.speed_rad_s)
    wandered, whole = _walk(rng, true.windows_s, effects.walk_rad_s_sqrt_s)
    flicker = effects.instability_rad_s**2 * flicker_covariance(true.windows_s)
    wandered = wandered + rng.multivariate_normal(np.zeros(len(flicker)), flicker, 3).T
    axes = _skewed(rng) @ _turned(rng, MOUNTING_RAD)
    heading, latitude = rng.uniform(0, 2 * np.pi), np.radians(effects.latitude_deg)
    earth = EARTH_RATE_RAD_S * np.array(
        [np.cos(latitude) * np.cos(heading), np.cos(latitude) * np.sin(heading), np.sin(latitude)]
    )
    up = np.array([0.0, 0.0, 1.0])
    sensitivity = rng.normal(0, effects.g_sensitivity_rad_s_g, (3, 3))  # of the sensor's axes to what they feel
    attitudes = true.attitudes.mean(axis=1)
    ways = true.arms_m + rng.uniform(-effects.offset_m, effects.offset_m, 3)
    force = attitudes @ up + centripetal_m_s2(true.rates_rad_s, ways) / STANDARD_GRAVITY_M_S2
    felt = force @ axes.T @ sensitivity.T
    turned = true.rates_rad_s + attitudes @ earth
    durations = np.diff(true.windows_s).T[0]
    variances = np.tile(effects.noise_rad_s**2 / (SAMPLE_RATE_HZ * durations)[:, None], 3)
    noise = np.sqrt(variances) * rng.standard_normal((len(durations), 3))
    warmth, recorded_k = _warmth(rng, effects, true)
    slope, change = (size * rng.uniform(-1, 1, 3) for size in (effects.bias_rad_s_per_k, effects.scale_per_k))
    wandered = wandered + (warmth - np.average(warmth, weights=durations))[:, None] * slope
    sweeps = durations * true.rates_rad_s.any(axis=1)
    along = _curved(turned @ axes.T, effects, rng) * (
        1 + (warmth - np.average(warmth, weights=sweeps))[:, None] * change
    )
    means = along / scale - bias + felt + wandered + noise
    clock = rng.uniform(-effects.clock, effects.clock)
    jitter = rng.normal(0, np.sqrt(2) * effects.jitter_s, len(durations)) / durations
    said = told.rates_rad_s * (1 - clock + jitter)[:, None]
    truth = np.concatenate([scale, bias - whole])
    corrected = said * (1 + clock + rng.normal(0, effects.clock_known))
    seen = Seen(
        means_rad_s=means,
        variances_rad2_s2=variances,
        turns_rad_s=corrected,
        earth_rate_rad_s=np.zeros(3),
        speed_std_rad_s=np.zeros(len(durations)),
        attitudes=told.attitudes.mean(axis=1),
        gravity_m_s2=told.attitudes.mean(axis=1) @ (-STANDARD_GRAVITY_M_S2 * up),
        windows_s=told.windows_s,
        joints=told.joints,
        arms_m=told.arms_m,
        sensor=KnownSensor(
            nonlinearity=effects.nonlinearity,
            full_scale_rad_s=effects.full_scale_rad_s,
            bias_rad_s_per_k=effects.bias_rad_s_per_k,
            scale_per_k=effects.scale_per_k,
            instability_rad_s=effects.instability_rad_s,
            temperature_c=recorded_k,
            temperature_step_k=STEP_K,
        ),
    )
    explained = explain(seen, np.eye(3))
    unknown = Unknown(
        clock_std=effects.clock_known,
        clock_source="",
        state_jitter_s=effects.jitter_s,
        axis_rad=effects.axis_rad * np.sqrt(3),
        sensor_offset_m=effects.offset_m,
        g_sensitivity_rad_s_per_g=effects.g_sensitivity_rad_s_g,
        earth_rate=True,
    )
    solved, plain = explained.solution, solve_vector_model(means, said, variances)
    with_all = (np.concatenate([solved.scale, solved.bias_rad_s]) - truth) / budget(explained, unknown).std
    without = (np.concatenate([plain.scale, plain.bias_rad_s]) - truth) / np.sqrt(np.diag(plain.covariance))
    return np.array([with_all, without])


def _curved(along_rad_s: Array, effects: Effects, rng: np.random.Generator) -> Array:
    """(N, 3) what a sensor takes rates along its axes for, if it is right at the speed of the sweeps."""
    cube, square = effects.nonlinearity / np.array([[CUBE_MISSED], [SQUARE_MISSED]]) * rng.uniform(-1, 1, (2, 3))
    share, swept = along_rad_s / effects.full_scale_rad_s, effects.speed_rad_s / effects.full_scale_rad_s
    curve = cube * (share**2 - swept**2) + square * share
    return np.asarray(along_rad_s * (1 + curve), dtype=np.float64)


def _warmth(rng: np.random.Generator, effects: Effects, session: Session) -> tuple[Array, Array]:
    """(N,) K above the start in the mean of each average, and as recorded in steps."""
    middle_s = session.windows_s.mean(axis=1)
    warmth = effects.warming_k * rng.uniform(-1, 1) * (1 - np.exp(-middle_s / WARM_UP_S))
    return warmth, STEP_K * np.round(warmth / STEP_K)


def _session(twists: Array, speed_rad_s: float) -> Session:
    """Six sweeps of wrists 3, 1 and 2 about flange z, y and x, each with the rest after it; then the rests.

    In the flange's frame a wrist's axis is fixed while that wrist turns, and `twists` (3, 2) tilt it. At home the
    flange's x, y and z point forward, left and up in the base.
    """
    attitudes, rates, arms, rest_attitudes, windows, rests = [], [], [], [], [], []
    start_s, sweep_s = 0.0, 2 * np.pi / speed_rad_s
    turn = np.linspace(-np.pi, np.pi, ATTITUDES, endpoint=False) + np.pi / ATTITUDES
    for number, joint in enumerate((2, 1, 0)):
        axis = np.eye(3)[joint].copy()
        axis[(joint + 1) % 3], axis[(joint + 2) % 3] = twists[number]
        axis /= np.linalg.norm(axis)
        for sign in (-1.0, 1.0):
            attitudes.append(_about(axis, -turn))
            rates.append(sign * speed_rad_s * axis)
            arms.append(ARMS_M[number])
            windows.append((start_s, start_s + sweep_s))
            rest_attitudes.append(np.repeat(_about(axis, np.array([-sign * np.radians(190)])), ATTITUDES, axis=0))
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


def _about(axis: Array, angles_rad: Array) -> Array:
    """(n, 3, 3) rotations about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sin, cos = np.sin(angles_rad)[:, None, None], np.cos(angles_rad)[:, None, None]
    rotations: Array = np.eye(3) + sin * cross + (1 - cos) * (cross @ cross)
    return rotations


def _turned(rng: np.random.Generator, angle_rad: float) -> Array:
    axis = rng.normal(size=3)
    rotation: Array = _about(axis / np.linalg.norm(axis), np.array([angle_rad]))[0]
    return rotation


def _skewed(rng: np.random.Generator) -> Array:
    """Unit axes as rows (3, 3), askew by some tenths of a degree."""
    axes = np.eye(3) + np.tril(rng.normal(0, SKEW_RAD, (3, 3)), -1)
    unit: Array = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return unit


def _walk(rng: np.random.Generator, windows_s: Array, rate: float) -> tuple[Array, Array]:
    """Means (N, 3) of a random walk over the windows, and (3,) over the whole time."""
    times_s = np.arange(windows_s.min(), windows_s.max(), STEP_S)
    walk = np.cumsum(rate * np.sqrt(STEP_S) * rng.standard_normal((len(times_s), 3)), axis=0)
    inside = (times_s >= windows_s[:, :1]) & (times_s < windows_s[:, 1:])
    return np.array([walk[each].mean(axis=0) for each in inside]), walk.mean(axis=0)


def _findings(rows: list[dict[str, Any]]) -> tuple[Finding, ...]:
    return tuple(
        Finding(f"± 2 u covers {row['parameter']}, {row['remedies']} the remedies", row["coverage_percent"], "%")
        for row in rows
    )


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panel = figure.subplots()
    for offset, remedies in ((-0.2, "with"), (0.2, "without")):
        covered = [row["coverage_percent"] for row in rows if row["remedies"] == remedies]
        panel.bar(np.arange(len(PARAMETERS)) + offset, covered, 0.4, label=f"{remedies} the remedies")
    panel.axhline(95.45, color="black", linestyle="--", linewidth=0.8)
    panel.set_xticks(range(len(PARAMETERS)), PARAMETERS)
    panel.set(ylabel="sessions whose truth lies within ± 2 u, %", ylim=(0, 100))
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
