"""Flashing of the shipped image to a Nucleo-L432KC: through its debug probe, or by a copy to its USB drive."""

import contextlib
import hashlib
import io
import os
import re
import stat
import struct
import sys
import time
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Any

from firmware_host.errors import BoardError
from firmware_host.installation import install_command
from firmware_host.protocol import FIRMWARE_VERSION

PACKAGE = Path(__file__).parent
TARGET = "stm32l432kc"
FLASH_START = 0x0800_0000
FLASH_BYTES = 256 * 1024
CALIBRATION_BYTES = 16 * 2048  # the last pages: a longer image would erase the calibrations
RAM_START, RAM_BYTES = 0x2000_0000, 64 * 1024
DEVICE_ID_REGISTER, DEVICE_ID = 0xE004_2000, 0x435  # DBGMCU_IDCODE of all STM32L43x and L44x (RM0394)
# The marks of an STM32L432KC among the chips of that code (RM0394, chapter 47): kilobytes of flash, and package.
SIZE_REGISTER, PACKAGE_REGISTER, UFQFPN32 = 0x1FFF_75E0, 0x1FFF_7500, 0x08
DEBUG_REGISTER = (
    0xE004_2004  # DBGMCU_CR: peripherals that keep their clock while the core sleeps; a reset does not clear it
)
# Under reset first: firmware that sleeps most of the time may block a probe. A probe without that mode halts it.
CONNECT_MODES = ("under-reset", "halt")

IMAGE_NAME = "rig_l432.bin"
NUCLEO_CODE = "0770"  # the Nucleo-L432KC in the link of its MBED.HTM, as in mbed-ls' table of platforms
DRIVE_TIMEOUT_S = 20.0
MAX_TEXT_BYTES = 10_000  # of a file on a Nucleo's drive
_POLL_S = 0.05


def load_shipped_image() -> bytes:
    """Return the image that comes with this program. Raise BoardError `bad_image` if it is invalid or has changed."""
    folder = resources.files("firmware_host") / "firmware" / "image"
    image = (folder / IMAGE_NAME).read_bytes()
    check_image(image)
    check_hash(image, (folder / f"{IMAGE_NAME}.sha256").read_text(encoding="ascii").split()[0])
    return image


def sha256(image: bytes) -> str:
    """Return the SHA-256 of an image, in hexadecimal."""
    return hashlib.sha256(image).hexdigest()


def check_hash(image: bytes, stated: str) -> None:
    """Raise BoardError `bad_image` if an image's SHA-256 is not the `stated` one, in hexadecimal."""
    if sha256(image) != stated.lower():
        raise _bad_image(f"its SHA-256 is {sha256(image)}, and not {stated}")


def check_image(image: bytes) -> None:
    """Raise BoardError `bad_image` unless `image` is firmware for this microcontroller, of this program's version."""
    if len(image) < 8 or len(image) > FLASH_BYTES - CALIBRATION_BYTES:
        raise _bad_image(f"it has {len(image)} bytes")
    stack, entry = struct.unpack_from("<II", image)
    if not RAM_START < stack <= RAM_START + RAM_BYTES or not FLASH_START < entry < FLASH_START + len(image):
        raise _bad_image("it does not begin with the vectors of an STM32L432")
    if FIRMWARE_VERSION.encode() + b"\0" not in image:
        raise _bad_image(f"it is not of version {FIRMWARE_VERSION}")


def _bad_image(why: str) -> BoardError:
    return BoardError(
        "bad_image",
        f"{IMAGE_NAME} is not the image this program needs: {why}",
        "Install the program again, or rebuild the image: `make -C firmware_host/firmware`",
    )


def find_probe(probe_id: str | None = None) -> Any:
    """Return the only connected debug probe (of pyocd), or the one whose id contains `probe_id`.

    Raise BoardError `flash_extra_missing`, `no_probe`, `several_probes`, `other_microcontroller`.
    """
    try:
        from pyocd.core.helpers import ConnectHelper
    except ImportError as error:
        raise BoardError(
            "flash_extra_missing",
            f"the library for debug probes is not installed ({error})",
            f"Install it: {install_command('flash')}, or copy to the board's drive with --drive",
        ) from error
    with contextlib.chdir(PACKAGE):
        probes = ConnectHelper.get_all_connected_probes(blocking=False, unique_id=probe_id)
    if not probes:
        raise BoardError(
            "no_probe",
            "no debug probe is connected" + (f" whose id contains {probe_id}" if probe_id else ""),
            "Connect the Nucleo by USB and allow its use (udev rules), or copy to its drive with --drive",
        )
    if len(probes) > 1:
        listing = ", ".join(f"{probe.unique_id} ({probe.description})" for probe in probes)
        raise BoardError(
            "several_probes", f"several debug probes are connected: {listing}", "Choose one with --probe ID"
        )
    _refuse_other_board(probes[0])
    return probes[0]


def _refuse_other_board(probe: Any) -> None:
    """Raise BoardError if a probe that is part of a board reports another board."""
    board = getattr(probe, "associated_board_info", None)
    if board is not None and not board.target.startswith(TARGET):
        raise _other_microcontroller(f"the probe {probe.unique_id} is that of a {board.name}, with an {board.target}")


def _other_microcontroller(what: str) -> BoardError:
    return BoardError("other_microcontroller", what, "Choose the Nucleo-L432KC's probe with --probe ID")


def flash_by_probe(image: bytes, probe: Any) -> None:
    """Program, read back and start `image` through a probe of `find_probe`.

    Only the pages of the image are erased, so stored calibrations remain. Raise BoardError `other_microcontroller`,
    `flash_failed`.
    """
    from pyocd.core.exceptions import Error
    from pyocd.core.session import Session

    failure: Exception | None = None
    for mode in CONNECT_MODES:
        options = {"target_override": TARGET, "hide_programming_progress": True, "connect_mode": mode}
        try:
            # pyocd executes a pyocd_user.py in the working folder, of any origin.
            with (
                contextlib.chdir(PACKAGE),
                Session(probe, options=options) as session,  # pyrefly: ignore[bad-context-manager]  # __exit__(None, …)
            ):
                _program(session, image)
            return
        except (Error, OSError) as error:
            failure = error
    raise BoardError(
        "flash_failed",
        f"the probe {probe.unique_id} could not program the board: {failure}",
        "Check the board's supply and try again",
    ) from failure


def _program(session: Any, image: bytes) -> None:
    """Check the microcontroller at the probe, write the image, verify it, and restart."""
    from pyocd.flash.file_programmer import FileProgrammer

    device = session.target.read32(DEVICE_ID_REGISTER) & 0xFFF
    if device != DEVICE_ID:
        raise _other_microcontroller(
            f"at the probe hangs a microcontroller of device code 0x{device:03x}, not an STM32L432 (0x{DEVICE_ID:03x})"
        )
    kilobytes = session.target.read32(SIZE_REGISTER) & 0xFFFF
    package = session.target.read32(PACKAGE_REGISTER) & 0x1F
    if (kilobytes * 1024, package) != (FLASH_BYTES, UFQFPN32):
        raise _other_microcontroller(
            f"at the probe hangs a microcontroller of the STM32L432's family with {kilobytes} KB of flash in package "
            f"{package}, not an STM32L432KC ({FLASH_BYTES // 1024} KB, {UFQFPN32})"
        )
    # Running firmware would be interrupted while its vectors are erased, or reset by its watchdog
    session.target.reset_and_halt()
    programmer = FileProgrammer(session, chip_erase="sector", trust_crc=False)
    programmer.program(io.BytesIO(image), file_format="bin", base_address=FLASH_START)
    if bytes(session.target.read_memory_block8(FLASH_START, len(image))) != image:
        raise BoardError(
            "flash_failed",
            "the board's flash reads back otherwise than it was written",
            "Try again; if that does not help, replace the board",
        )
    # pyocd sets these bits when it connects; they trigger an erratum of the chip in every sleep until a power-off
    session.target.write32(DEBUG_REGISTER, 0)
    session.target.reset()


def flash_by_drive(image: bytes, drive: Path, timeout_s: float = DRIVE_TIMEOUT_S) -> None:
    """Copy `image` to the Nucleo's USB drive and wait until the board has taken it.

    The drive is virtual: the probe programs the copied file, restarts the target, and mounts the drive again, with a
    FAIL.TXT after a failure. Raise BoardError `no_drive`, `not_a_nucleo_drive`, `flash_failed`, `flash_unconfirmed`.
    """
    refuse_other_drive(drive)
    copied, failure = drive / IMAGE_NAME, drive / "FAIL.TXT"
    try:
        failure.unlink(missing_ok=True)  # of an earlier attempt
        with open(copied, "wb", opener=_no_link) as file:
            file.write(image)
            file.flush()
            with contextlib.suppress(OSError):  # the drive may be gone already, once the board has all of it
                os.fsync(file.fileno())
    except OSError as error:
        raise BoardError(
            "flash_failed", f"{drive} does not take the image: {error}", "Unplug the board, plug it in, and try again"
        ) from error
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        try:
            # In this order: an unmounted drive shows no image either, and FAIL.TXT appears with the drive.
            is_mounted = not copied.exists() and _code(drive) is not None
            if failure.exists():
                raise BoardError(
                    "flash_failed",
                    f"the board did not take the image: {' '.join(_short_text(failure).split())}",
                    "Unplug the board, plug it in, and try again, or flash through the probe",
                )
            if is_mounted:
                return
        except OSError:
            pass  # the drive is being unmounted or mounted
        time.sleep(_POLL_S)
    raise BoardError(
        "flash_unconfirmed",
        f"the drive {drive} did not show within {timeout_s:g} s that the board has taken the image",
        "Unplug the board, plug it in, and look with `rig board info`",
    )


def find_drive(candidates: Iterable[Path] | None = None) -> Path:
    """Return the only Nucleo-L432KC's drive among `candidates`, by default all mounted drives.

    Raise BoardError `no_drive`, `several_drives`.
    """
    drives = [drive for drive in (_list_drives() if candidates is None else candidates) if _code(drive) == NUCLEO_CODE]
    if not drives:
        raise BoardError(
            "no_drive",
            "no drive of a Nucleo-L432KC is mounted",
            "Connect the board by USB and open its drive once, or name the drive: --drive PATH",
        )
    if len(drives) > 1:
        listing = ", ".join(map(str, drives))
        raise BoardError("several_drives", f"several Nucleo boards show a drive: {listing}", "Choose one: --drive PATH")
    return drives[0]


def refuse_other_drive(drive: Path) -> None:
    """Raise BoardError `no_drive` or `not_a_nucleo_drive` unless `drive` is a Nucleo-L432KC's."""
    if not drive.is_dir():
        raise BoardError("no_drive", f"there is no drive {drive}", "Connect the board by USB and open its drive once")
    code = _code(drive)
    if code != NUCLEO_CODE:
        finding = "it has no MBED.HTM" if code is None else f"its board's code is {code}, not {NUCLEO_CODE}"
        raise BoardError(
            "not_a_nucleo_drive",
            f"{drive} is not the drive of a Nucleo-L432KC: {finding}",
            "Name the drive called NODE_L432KC",
        )


def _code(drive: Path) -> str | None:
    """Return the board code of a drive, from the link in its MBED.HTM; None if the drive has no such file."""
    try:
        page = _short_text(drive / "MBED.HTM")
    except OSError:
        return None
    match = re.search(r"code=(\w{4})", page)
    return match[1].upper() if match else "unknown"


def _short_text(path: Path) -> str:
    """Return the start of a file on an untrusted drive. Raise OSError for a pipe, a device or a link."""
    with open(path, "rb", opener=_no_link) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(f"{path} is no regular file")
        return file.read(MAX_TEXT_BYTES).decode(errors="replace")


def _no_link(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0), 0o666)


def _list_drives() -> list[Path]:
    if sys.platform == "win32":
        return [Path(f"{letter}:/") for letter in "DEFGHIJKLMNOPQRSTUVWXYZ"]
    roots = ("/Volumes/*",) if sys.platform == "darwin" else ("/media/*", "/media/*/*", "/run/media/*/*", "/mnt/*")
    return sorted(path for pattern in roots for path in Path("/").glob(pattern[1:]))
