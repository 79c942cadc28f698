"""States of any number of joints come back as their turner described them; what describes none is refused."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rig.data.recording.recorded_turner import RecordedTurner, turner_of
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import RunRecorder, read_run
from rig.errors import Refused
from rig.motion.chain import DenavitHartenberg
from rig.motion.state_rows import StateField
from rig.motion.turner_state import JointState
from support.recordings.synthetic_run import SENSOR, UR, Setup, synthetic_run


@cache
def recorded_run() -> RunData:
    return synthetic_run(Setup(rest_s=0.5, speed_deg_s=150))


def turner(joints: int, fields: tuple[StateField, ...] = ()) -> RecordedTurner:
    zeros = (0.0,) * joints
    names = tuple(f"axis {number}" for number in range(joints))
    return RecordedTurner("gimbal", "Toys", None, names, DenavitHartenberg(zeros, zeros, zeros, zeros), fields)


def recorded(path: Path, described: RecordedTurner, states: int = 20) -> Path:
    joints = len(described.joints)
    run = recorded_run()
    settings = replace(run.settings, home_q_rad=(0.0,) * joints)
    with RunRecorder(
        path,
        config=run.config,
        settings=settings,
        provenance=run.provenance,
        turner=described,
        sensors={"gyro": SENSOR},
    ) as recorder:
        for number in range(states if joints and not described.fields else 0):
            angles = tuple(number + 0.1 * joint for joint in range(joints))
            recorder.add_state(JointState(0.01 * number, 1.0 + number, angles, (0.5,) * joints))
    return path


@pytest.mark.parametrize("joints", [0, 1, 2, 3, 8])
def test_states_of_any_number_of_joints_come_back(joints: int, tmp_path: Path) -> None:
    run = read_run(recorded(tmp_path / "run.h5", turner(joints)))
    assert run.turner == turner(joints)
    if joints:
        assert run.states["q_rad"].shape == run.states["qd_rad_s"].shape == (20, joints)
        np.testing.assert_array_equal(run.states["q_rad"][3], [3 + 0.1 * joint for joint in range(joints)])
    else:
        assert run.states.dtype.names == ("time_s", "host_time_s")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"])
def test_further_fields_of_a_state_have_the_type_that_the_turner_declares(kind: Any, tmp_path: Path) -> None:
    described = turner(2, (StateField("current_a", kind),))
    run = read_run(recorded(tmp_path / "run.h5", described))
    assert run.turner == described and run.states.dtype["current_a"] == np.dtype(f"<{kind}")


def test_a_turner_describes_itself_in_json() -> None:
    assert turner_of(UR.to_json()) == UR


def described(**changes: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file.attrs["turner"] = json.dumps({**asdict(turner(2)), **changes})

    return change


def states_of(dtype: object, shape: tuple[int, ...] = (5,)) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file["states"]
        file.create_dataset("states", shape, dtype)

    return change


def field(name: object, kind: object) -> Callable[[h5py.File], None]:
    return described(fields=[{"name": name, "type": kind}])


def geometry(joints: int) -> dict[str, list[float]]:
    return {name: [0.0] * joints for name in ("theta_rad", "a_m", "d_m", "alpha_rad")}


def no_turner(file: h5py.File) -> None:
    del file.attrs["turner"]


def text(value: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file.attrs["turner"] = value

    return change


NINE = [f"axis {number}" for number in range(9)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "says"),
    [
        (no_turner, "its turner is not a text"),
        (text("{"), "not_a_run_file"),
        (text("[" * 60_000), "not_a_run_file"),
        (text("[]"), r"turner is \[\]"),
        (described(joints=NINE, geometry=geometry(9)), r"turner\.(joints|geometry)"),
        (described(joints=["a/b", "c"]), r"turner\.joints"),
        (described(joints=["a", "a"]), "one name"),
        (described(joints=["a\n", "c"]), r"turner\.joints"),
        (described(geometry=geometry(3)), "2 joints but a geometry of 3"),
        (described(geometry={**geometry(2), "a_m": [0.0]}), "geometry"),
        (described(geometry={**geometry(2), "a_m": [0.0, float("nan")]}), "'NaN' is not a number"),
        (described(kind="../ur"), r"turner\.kind"),
        (described(fields=[{"name": f"f{n}", "type": "f8"} for n in range(1000)]), r"turner\.fields"),
        (field("current_a", "O"), r"turner\.fields"),
        (field("current_a", "S1000000000"), r"turner\.fields"),
        (field("q_rad", "f8"), "one name"),
        (field("a b", "f8"), "a name that is not allowed"),
        (field("a" * 1000, "f8"), "a name that is not allowed"),
        (field("current_a", "f8"), "states holds"),
        (described(joints=["a"], geometry=geometry(1)), "states holds"),
        (states_of("f8", (2, 3)), "states holds float64 in 2 dimensions"),
    ],
)
def test_a_turner_that_cannot_be_is_refused(change: Callable[[h5py.File], None], says: str, tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.h5", turner(2))
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(Refused, match=says) as refused:
        read_run(path)
    assert refused.value.name == "not_a_run_file"


def test_poses_have_the_joints_of_the_turner(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.h5", turner(2))
    with h5py.File(path, "r+") as file:
        settings = json.loads(file.attrs["settings"])
        file.attrs["settings"] = json.dumps({**settings, "home_q_rad": [0.0] * 3})
    with pytest.raises(Refused, match="2 joints, but one of its poses has another number"):
        read_run(path)


def test_the_geometry_is_said_once(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.h5", turner(2))
    with h5py.File(path, "r+") as file:
        provenance = json.loads(file.attrs["provenance"])
        file.attrs["provenance"] = json.dumps({**provenance, "arm_kinematics": geometry(6)})
    with pytest.raises(Refused, match="another geometry"):
        read_run(path)
