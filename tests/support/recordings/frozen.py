"""Frozen recordings, one of each kind, and the commands that freeze another one:

    rig run CONFIG --out RUN
    PYTHONPATH=tests python -m support.recordings.frozen RUN KIND

A frozen recording is a run folder: recordings, their configuration, and the result that they must give.
"""

import shutil
import sys
from pathlib import Path

from rig.data.run_folder import CONFIG, RESULT, recordings
from support.paths import RECORDINGS


def frozen() -> list[Path]:
    """Return the folders of all frozen recordings."""
    return sorted(path.parent for path in RECORDINGS.rglob("run.h5"))


def freeze(run: Path, kind: str) -> Path:
    """Copy a finished run, compressed, to the frozen recordings. Return its folder."""
    folder = RECORDINGS / kind
    folder.mkdir()
    for name in (CONFIG, RESULT):
        shutil.copyfile(run / name, folder / name)
    for path in _recordings(run):
        _compress(path, folder / path.name)
    return folder


def _recordings(folder: Path) -> list[Path]:
    return [*recordings(folder, "raw"), *recordings(folder, "calibrated")]


def _compress(source: Path, target: Path) -> None:
    """Copy attributes and rows compressed, because a run file reserves space for more."""
    import h5py

    with h5py.File(source) as file, h5py.File(target, "w") as copy:
        copy.attrs.update(file.attrs)
        for name in ("states", "events", *(f"samples/{sensor}" for sensor in file["samples"])):
            rows = file[name]
            packed = {"compression": "gzip", "compression_opts": 9, "shuffle": True}
            copy.create_dataset(name, data=rows[:], maxshape=(None,), chunks=rows.chunks, **packed)
            copy[name].attrs.update(rows.attrs)


if __name__ == "__main__":
    print(freeze(Path(sys.argv[1]), sys.argv[2]))
