"""A recorded mounting that is not a rotation is refused in words alone: NumPy's warnings would come before them."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.data.recording.run_file import read_run
from rig.errors import Refused
from support.paths import RECORDINGS


@pytest.mark.parametrize("element", [0.0, float("nan"), 1e200])
def test_a_mounting_that_is_no_rotation_is_refused(element: float, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copyfile(RECORDINGS / "six_observation" / "run.h5", path)
    with h5py.File(path, "r+") as file:
        file["samples/gyro"].attrs["mounting"] = element * np.ones((3, 3))
    with pytest.raises(Refused, match="not_a_run_file"):
        read_run(path)
