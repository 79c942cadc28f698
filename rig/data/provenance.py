"""What was measured with what: recorded beside the measurement, and part of every result."""

import hashlib
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from firmware_host.client import BoardIdentity, StoredCalibration
from rig import __version__
from rig.arm.state import ArmReport
from rig.config.load import Loaded

PACKAGES = ("ur-rtde", "numpy", "h5py", "pyserial")


def provenance(
    loaded: Loaded,
    board: BoardIdentity,
    arm: ArmReport,
    stored: Mapping[str, StoredCalibration],
    script: Mapping[str, str | bool],
) -> dict[str, Any]:
    """Versions, serial numbers, the configuration's and the script's hashes, the time; fits into JSON.

    `stored` are the calibrations by which the board corrects what it streams, `script` says by which script it was.
    """
    return {
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "rig_version": __version__,
        "python_version": platform.python_version(),
        "package_versions": {name: version(name) for name in PACKAGES},
        "configuration_sha256": hashlib.sha256(loaded.rig_text.encode()).hexdigest(),
        **script,
        "arm_serial_number": arm.serial_number,
        "arm_software": arm.polyscope,
        "board_unique_id": board.unique_id,
        "firmware_version": board.firmware,
        "sensor_serial_numbers": {name: section.serial_number for name, section in loaded.config.sensors.items()},
        "stored_calibrations": {name: calibration.document() for name, calibration in stored.items()},
    }
