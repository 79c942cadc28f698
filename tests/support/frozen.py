"""Recordings frozen as the rig of their time wrote them, and how another one is frozen:

    rig run CONFIG --out RUN
    PYTHONPATH=tests python -m support.frozen RUN KIND

A frozen recording is a run folder: recordings, the configuration they were made by, and the result they are to give.
They lie by the schema of their settings, those of before there were settings with the other fixtures of their commit.
"""

import json
import shutil
import sys
from pathlib import Path

from rig.data.run_folder import CONFIG, RESULT, recordings
from rig.data.schema import states_name
from support.paths import FIXTURES, ROOT

RECORDINGS = ROOT / "tests" / "fixtures" / "recordings"


def frozen() -> list[Path]:
    """The folders of all of them."""
    return sorted(path.parent for top in (FIXTURES, RECORDINGS) for path in top.rglob("run.h5"))


def schemas(folder: Path) -> set[str]:
    """Of the recordings in a run folder, and of their settings where they have some."""
    import h5py

    found = set()
    for path in _recordings(folder):
        with h5py.File(path) as file:
            found |= {file.attrs["schema"], json.loads(file.attrs.get("settings", "{}")).get("schema")}
    return found - {None}


def freeze(run: Path, kind: str) -> Path:
    """A finished run into its place among the frozen recordings, compressed; returns where that is."""
    (schema,) = (name for name in schemas(run) if name.startswith("rig.settings/"))
    folder = RECORDINGS / schema.replace("/", "-") / kind
    folder.mkdir(parents=True)
    for name in (CONFIG, RESULT):
        shutil.copyfile(run / name, folder / name)
    for path in _recordings(run):
        _compress(path, folder / path.name)
    return folder


def _recordings(folder: Path) -> list[Path]:
    return [*recordings(folder, "raw"), *recordings(folder, "calibrated")]


def _compress(source: Path, target: Path) -> None:
    """The same attributes and rows: a run file as it is written has room for more."""
    import h5py

    with h5py.File(source) as file, h5py.File(target, "w") as copy:
        copy.attrs.update(file.attrs)
        for name in (states_name(file.attrs["schema"]), "events", *(f"samples/{sensor}" for sensor in file["samples"])):
            rows = file[name]
            packed = {"compression": "gzip", "compression_opts": 9, "shuffle": True}
            copy.create_dataset(name, data=rows[:], maxshape=(None,), chunks=rows.chunks, **packed)
            copy[name].attrs.update(rows.attrs)


if __name__ == "__main__":
    print(freeze(Path(sys.argv[1]), sys.argv[2]))
