"""MATLAB's files are tables whose columns have MATLAB's own names, in every version of the format."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from rig.config.column_map import ColumnMap
from rig.data.quantity import RATE
from rig.errors import Refused
from rig.observation.external.csv_samples import read_samples
from rig.observation.formats.column_selection import map_samples
from rig.observation.formats.mat_table import read_mat_columns

pytestmark = pytest.mark.slow

TIME_S = np.arange(30) * 0.01
RATES = np.column_stack([np.sin(TIME_S), np.cos(TIME_S), TIME_S])


def newest(path: Path, variables: dict[str, Any]) -> None:
    """Write version 7.3: HDF5 behind a block of 512 bytes, matrices transposed, structs as groups."""

    def fill(group: Any, members: dict[str, Any]) -> None:
        for name, value in members.items():
            if isinstance(value, dict):
                fill(group.create_group(name), value)
            elif isinstance(value, str):
                group.create_dataset(name, data=np.frombuffer(value.encode("utf-16-le"), np.uint16)[:, None])
                group[name].attrs["MATLAB_class"] = np.bytes_("char")
            else:
                group.create_dataset(name, data=np.atleast_2d(value).T)

    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file, variables)
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)


WRITERS: dict[str, Callable[[Path, dict[str, Any]], None]] = {
    "5": lambda path, variables: savemat(path, variables, do_compression=True),
    "7.3": newest,
}


@pytest.mark.parametrize("version", WRITERS)
def test_a_struct_s_matrices_are_columns(version: str, tmp_path: Path) -> None:
    path = tmp_path / "LOG.MAT"
    WRITERS[version](
        path, {"imu": {"t": TIME_S[:, None], "gyro": RATES.T, "name": "flange"}, "fs": np.array([[100.0]])}
    )
    columns = {"time_s": {"column": "imu.t"}} | {
        f"{axis}_rad_s": {"column": f"imu.gyro({row + 1},:)"} for row, axis in enumerate("xyz")
    }
    samples = read_samples(path, [RATE], map_samples(ColumnMap.model_validate({"samples": columns})))
    assert np.array_equal(samples.time_s, TIME_S) and np.array_equal(samples.readings[RATE], RATES)


def test_columns_of_the_rig_s_own_names_need_no_map(tmp_path: Path) -> None:
    own = {"time_s": TIME_S, **{f"{axis}_rad_s": rates for axis, rates in zip("xyz", RATES.T, strict=True)}}
    savemat(tmp_path / "log.mat", own)
    assert np.array_equal(read_samples(tmp_path / "log.mat", [RATE]).readings[RATE], RATES)


def test_what_save_ascii_writes_is_a_text_table(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    np.savetxt(path, np.column_stack([TIME_S, RATES]), fmt="%16.7e")
    columns = {
        name: {"column": str(index + 1)} for index, name in enumerate(["time_s", "x_rad_s", "y_rad_s", "z_rad_s"])
    }
    samples = read_samples(path, [RATE], map_samples(ColumnMap.model_validate({"samples": columns})))
    assert samples.readings[RATE] == pytest.approx(RATES, rel=1e-6)


def test_columns_of_two_tables_are_not_joined(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    savemat(path, {"t": np.arange(10.0), "gyro": RATES})
    columns = {"time_s": {"column": "t"}} | {
        f"{axis}_rad_s": {"column": f"gyro(:,{column + 1})"} for column, axis in enumerate("xyz")
    }
    with pytest.raises(Refused, match=r"wrong_columns: .*'t' has 10 rows, and .*30"):
        read_samples(path, [RATE], map_samples(ColumnMap.model_validate({"samples": columns})))


@pytest.mark.parametrize("spelt", ["NaN", "nan"])
def test_a_row_of_nan_is_missing_however_the_map_spells_it(spelt: str, tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    savemat(path, {"t": TIME_S, "gyro": np.where(TIME_S[:, None] == TIME_S[7], np.nan, RATES)})
    columns = {"time_s": {"column": "t"}} | {
        f"{axis}_rad_s": {"column": f"gyro(:,{column + 1})"} for column, axis in enumerate("xyz")
    }
    stated = ColumnMap.model_validate({"samples": columns, "samples_missing": [spelt]})
    samples = read_samples(path, [RATE], map_samples(stated))
    assert np.array_equal(samples.readings[RATE], np.delete(RATES, 7, axis=0))


def test_a_link_to_another_file_is_not_followed(tmp_path: Path) -> None:
    newest(tmp_path / "log.mat", {"t": TIME_S[:, None]})
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["secret"] = RATES
    with h5py.File(tmp_path / "log.mat", "r+") as file:
        file["gyro"] = h5py.ExternalLink("other.h5", "/secret")
    assert [*read_mat_columns(tmp_path / "log.mat")] == ["t"]
