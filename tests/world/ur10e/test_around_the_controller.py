"""What stands around the simulated controller: a fieldbus that stops programs, and a program that logs its poses."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Refused
from rig.observation.external.attitude_import import read_attitudes
from rig.world.clock import TICKS_PER_SECOND
from rig.world.laboratory import Laboratory
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.modes import RuntimeState, SafetyMode
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal
from support.paths import DEMO

PROGRAM = b"def wait():\n  sleep(60)\nend\n"
MOVE = b"def turn():\n movej([0, -1.57, 1.57, -1.57, -1.57, 3], a=4, v=0.5)\nend\n"
ZEROS_RAD = (0.0, 0.0, 0.0, 0.02, 0.0, 0.0)


def laboratory(*overrides: str) -> Laboratory:
    """A laboratory without its board, which takes most of the time."""
    loaded = ideal(DEMO, [*overrides])
    built = Laboratory(loaded.config, read_world_section(loaded))
    built.unplug()
    return built


@pytest.mark.parametrize(
    ("stop", "safety_mode"), [("protective", SafetyMode.PROTECTIVE_STOP), ("program", SafetyMode.NORMAL)]
)
def test_a_fieldbus_without_its_connection_stops_every_program_soon_after_its_start(
    stop: str, safety_mode: SafetyMode
) -> None:
    robot = laboratory(f"world.arm.fieldbus={{stop: {stop}, after_s: 0.1}}").robot
    for _ in range(2):
        PrimarySession(robot).receive(PROGRAM)
        played = []
        for _ in range(TICKS_PER_SECOND // 4):
            robot.step()
            played.append(robot.runtime_state == RuntimeState.PLAYING)
        assert sum(played) == round(0.1 * TICKS_PER_SECOND) and not played[-1]
        assert robot.safety_mode == safety_mode
        robot.unlock_protective_stop()
        while robot.safety_mode != SafetyMode.NORMAL:
            robot.step()


@pytest.mark.slow
def test_a_pose_log_is_slow_late_and_off_as_stated_and_the_rig_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    built = laboratory(
        f"world.arm.log={{path: '{path}', rate_hz: 14, latency_ms: 80, jitter_ms: 2.5}}",
        f"world.arm.unmodelled.zero_rad={[*ZEROS_RAD]}",
    )
    PrimarySession(built.robot).receive(MOVE)
    times_s = []
    true = []
    for _ in range(8 * TICKS_PER_SECOND):
        built.turn()
        times_s.append(built.on_arm.time_s)
        true.append(built.on_arm.frames_at(times_s[-1])[-1][0])
    rows = read_attitudes(path)
    stamps_s = (rows["start_s"] + rows["end_s"]) / 2
    logged = Rotation.from_quat(np.column_stack([rows[name] for name in ("qx", "qy", "qz", "qw")]))
    assert len(stamps_s) == pytest.approx(8 * 14, abs=1)
    looked_s = np.arange(len(stamps_s)) / 14
    late_ms = 1e3 * (stamps_s - looked_s)
    assert late_ms.mean() == pytest.approx(81, abs=2) and 1.5 < late_ms.std() < 4.0  # a look waits for a tick
    nearest = np.minimum(np.searchsorted(times_s, looked_s - 1e-9), len(times_s) - 1)
    errors = (logged * Rotation.from_matrix(np.array(true)[nearest]).inv()).magnitude()
    assert errors == pytest.approx(0.02, abs=2e-3), "the joint's zero, whatever the pose"
    assert (logged[0].inv() * logged[-1]).magnitude() > 2.0, "it has turned"


def test_a_log_that_cannot_be_written_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(Refused, match=r"arm_log_file: world\.arm\.log\.path .*No such file"):
        laboratory(f"world.arm.log.path={tmp_path / 'nowhere' / 'poses.csv'}")
