"""Recordings of one sensor on one arm, mounted again for each stage with another small error.

Each is drawn as by `support.recordings.drawn_recording`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from rig.config.load import parse
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.config.procedures.stage_section import rotation_by
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.motion.geometry import flange_attitude, flange_pose, flange_rate
from rig.plans.motions.six_sweeps import plan_six_observation
from support.recordings.drawn_recording import Kind, _counts, _delay_encoders, _draw_drift, _draw_true_motion, _sense
from support.recordings.synthetic_run import Motion, Setup, run_data, sample_times, sizes_of

QUARTER_TURNS = (
    "{instruction: as it is}",
    "{instruction: a quarter about z, mount: {x: +y, y: -x, z: +z}}",
    "{instruction: a quarter about x, mount: {x: +x, y: +z, z: -y}}",
)


def stage_setup(setup: Setup, stages: Sequence[str] = QUARTER_TURNS) -> Setup:
    """Return the same movement in stages."""
    return replace(setup, procedure=(*setup.procedure, ("stages", f"[{', '.join(stages)}]")))


def drawn_stages(seed: int, kind: Kind, setup: Setup, off_deg: Array) -> tuple[list[RunData], Array]:
    """Draw a recording of each stage of `setup`; return them and the drawn scale factors (3,).

    `off_deg` (S, 3) are rotation vectors of the item's mounting errors. Sensor and arm are the same in all stages;
    noise, bias drift and clock are each stage's own.
    """
    runs: list[RunData] = []
    scale: Array = np.ones(3)
    for stage, offset in enumerate(np.radians(off_deg)):
        alike, own_rng = np.random.default_rng([seed, 1000]), np.random.default_rng([seed, stage])
        room = EARTH_RATE_RAD_S * alike.uniform(-1, 1, 3)
        bias = alike.uniform(-0.02, 0.02, 3)
        stage_setup_of = replace(
            setup,
            seed=seed,
            sample_rate_hz=kind.sensor.rate_hz,
            vibration=float(own_rng.uniform(0.0, 0.05)),
            boot_s=float(own_rng.uniform(-1e4, 0.0)),
            drift=float(alike.uniform(-5e-5, 5e-5)),
        )
        motion = move_in_stage(stage_setup_of, stage, own_rng)
        uncertainty = motion.settings.uncertainty
        assert uncertainty is not None
        board_s, time_s = sample_times(stage_setup_of, motion)
        q_rad, qd_rad_s, arm = _draw_true_motion(
            motion, time_s, uncertainty, np.random.default_rng([seed, 2000]), setup.encoders_err
        )
        to_item = rotation_by(offset) @ np.array(motion.settings.mount)
        to_flange = flange_attitude(q_rad, arm)
        place_m = CubicSpline(time_s, flange_pose(q_rad, arm)[:, :3, 3])
        pull = np.einsum("nij,nj->ni", to_flange, [0.0, 0.0, -STANDARD_GRAVITY_M_S2] - place_m(time_s, 2))
        turned = flange_rate(q_rad, qd_rad_s, arm) + to_flange @ room
        alike_rng, speed_rad_s = np.random.default_rng([seed, 3000]), float(np.radians(setup.speed_deg_s))
        rates, scale = _sense(turned @ to_item.T, pull @ to_item.T, kind, alike_rng, speed_rad_s)
        read = (
            rates
            + bias
            + _draw_drift(len(time_s), kind, own_rng)
            + kind.noise_rad_s * own_rng.standard_normal(rates.shape)
        )
        run = _delay_encoders(
            run_data(stage_setup_of, motion, board_s, _counts(read, kind)), motion, stage_setup_of, own_rng
        )
        sizes = sizes_of({"gyro": kind.sensor.part})
        settings = replace(run.settings, uncertainty=uncertainty.model_copy(update=sizes))
        runs.append(replace(run, sensors={"gyro": kind.sensor}, settings=settings))
    return runs, scale


def move_in_stage(setup: Setup, stage: int, rng: np.random.Generator) -> Motion:
    """Return the movement of one stage, and the settings of its recording."""
    motion = Motion(setup, rng)
    config = parse(motion.config).config
    assert isinstance(config.procedure, SixSweepsSection)
    others = {index for number, other in enumerate(motion.plan.stages) for index in other.indices if number != stage}
    motion.plan = plan_six_observation(config.arm, config.procedure, done=others)
    motion.settings = replace(motion.settings, stage=stage)
    motion.ends = 101.0 + np.cumsum([step.duration_s for step in motion.plan.steps])
    motion.end_s = float(motion.ends[-1]) + 1.0
    return motion
