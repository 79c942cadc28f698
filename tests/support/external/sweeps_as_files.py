"""Files of samples and sweeps, read and averaged as `rig solve --sweeps` does."""

from pathlib import Path

from rig.data.quantity import RATE
from rig.observation.external.csv_import import ExternalData, average_sweeps, read_sweeps
from rig.observation.external.csv_samples import read_samples


def average_files(samples: Path, sweeps: Path) -> ExternalData:
    """Return the averages of the two files. Raise Refused and Fault as `rig solve --sweeps` does."""
    return average_sweeps(read_samples(samples, [RATE]), read_sweeps(sweeps))
