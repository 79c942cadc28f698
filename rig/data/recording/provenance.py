"""The provenance of a measurement: recorded with it, and part of every result."""

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from firmware_host.answers import BoardIdentity, StoredCalibration
from rig.data.absent import NO_ARM, NO_BOARD
from rig.data.entries.result_types import Utc
from rig.data.recording.motion_file import Item
from rig.data.result_file import FileEntry, StoredCalibrationEntry
from rig.data.run_folder import ScriptIdentity
from rig.data.validation import Finite, validate
from rig.data.version import VERSION
from rig.motion.chain import DenavitHartenberg
from rig.motion.turner_state import Report, TurnerIdentity

if TYPE_CHECKING:
    from rig.config.load import Loaded

FILE_KEYS = ("readings_file", "motion_file")
OPTIONAL_KEYS = ("arm_kinematics", "tcp_offset", "arm_maker", "arm_model", "turner_kind", "board_follows_crystal")
SIMULATED_SUFFIX = "(simulated)"  # ends the version of a simulated controller
PACKAGES = ("ur-rtde", "numpy", "h5py", "pyserial")


@dataclass(frozen=True, slots=True)
class Provenance:
    """The origin of a recording; "arm" means any turner, `NO_BOARD` replaces values that only a board provides.

    - started_utc: the time of its start.
    - rig_version, python_version, package_versions, firmware_version: the software.
    - configuration_sha256: the hash of the configuration.
    - arm_serial_number, arm_software, board_unique_id: the devices.
    - sensor_serial_numbers: the serial numbers, by sensor name.
    - stored_calibrations: the calibrations by which the board corrected its stream, by sensor name.
    - script, script_sha256, script_installed: the procedure's script, its hash, and whether a package provided it.
    - arm_kinematics: the turner's geometry, None without one.
    - tcp_offset: the controller's tool centre point in the flange's frame, unused; None if unknown.
    - arm_maker, arm_model: of the connected turner.
    - turner_kind: its registered kind.
    - board_follows_crystal: the board's statement on its clock, None without a board.
    - readings_file, motion_file: the files of an external recording.
    """

    started_utc: Utc
    rig_version: str
    python_version: str
    package_versions: Mapping[str, str]
    configuration_sha256: str
    arm_serial_number: str
    arm_software: str
    board_unique_id: str
    firmware_version: str
    sensor_serial_numbers: Mapping[str, str]
    stored_calibrations: Mapping[str, StoredCalibrationEntry] = field(default_factory=dict)
    script: str | None = None
    script_sha256: str | None = None
    script_installed: bool = True
    arm_kinematics: DenavitHartenberg | None = None
    tcp_offset: Annotated[tuple[Finite, ...], Field(min_length=6, max_length=6)] | None = None
    arm_maker: str | None = None
    arm_model: str | None = None
    turner_kind: str | None = None
    board_follows_crystal: bool | None = None
    readings_file: FileEntry | None = None
    motion_file: FileEntry | None = None

    @property
    def script_identity(self) -> ScriptIdentity:
        """The script that made the recording; an empty identity if it is not recorded."""
        return ScriptIdentity(self.script or "", self.script_sha256 or "")

    def document(self) -> dict[str, Any]:
        """Return the provenance as plain JSON values, without the fields whose values are unknown."""
        stored = {name: entry.model_dump(mode="json") for name, entry in self.stored_calibrations.items()}
        files = {name: value.model_dump() for name in FILE_KEYS if (value := getattr(self, name)) is not None}
        document = {**asdict(self), "stored_calibrations": stored, **files}
        unknown = {"script", "script_sha256", "script_installed"} if self.script_sha256 is None else set()
        unknown |= {name for name in (*OPTIONAL_KEYS, *FILE_KEYS) if document[name] is None}
        return {key: value for key, value in document.items() if key not in unknown}


def calls_itself_simulated(software: str) -> bool:
    """Return whether the name of a controller's software states that the controller is simulated."""
    return software.endswith(SIMULATED_SUFFIX)


def provenance_of_files(readings: FileEntry, motion: FileEntry | None, item: Item, start: datetime) -> Provenance:
    """Return the provenance of an item's external readings that begin at `start`: without arm and board."""
    return Provenance(
        started_utc=start.astimezone(UTC).isoformat(timespec="seconds"),
        **_program(),
        configuration_sha256=hashlib.sha256(b"").hexdigest(),
        arm_serial_number=NO_ARM,
        arm_software=NO_ARM,
        board_unique_id=NO_BOARD,
        firmware_version=NO_BOARD,
        sensor_serial_numbers={item.name: item.serial_number},
        readings_file=readings,
        motion_file=motion,
    )


def _program() -> dict[str, Any]:
    """Return the versions of the rig, of Python and of the packages, as fields of a `Provenance`."""
    return {
        "rig_version": VERSION,
        "python_version": platform.python_version(),
        "package_versions": {name: version(name) for name in PACKAGES},
    }


def provenance_of(
    loaded: "Loaded",
    board: BoardIdentity | None,
    turner: Report,
    model: TurnerIdentity,
    *,
    stored: Mapping[str, StoredCalibration],
    script: ScriptIdentity,
    script_installed: bool,
    follows_crystal: bool | None,
    kind: str,
) -> Provenance:
    """Return the provenance of a recording that begins now, with a turner of the given `kind` and `model`."""
    return Provenance(
        started_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        **_program(),
        configuration_sha256=hashlib.sha256(loaded.rig_text.encode()).hexdigest(),
        arm_serial_number=turner.serial_number,
        arm_software=turner.software,
        board_unique_id=NO_BOARD if board is None else board.unique_id,
        firmware_version=NO_BOARD if board is None else board.firmware,
        sensor_serial_numbers={name: sensor.serial_number for name, sensor in loaded.config.all_sensors.items()},
        stored_calibrations={
            name: validate(StoredCalibrationEntry, calibration.document(), name) for name, calibration in stored.items()
        },
        script=script.name,
        script_sha256=script.sha256,
        script_installed=script_installed,
        arm_kinematics=model.kinematics,
        tcp_offset=model.tcp_offset,
        arm_maker=model.maker,
        arm_model=model.model,
        turner_kind=kind,
        board_follows_crystal=follows_crystal,
    )
