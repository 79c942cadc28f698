"""`rig board flash`: the shipped image, the drive a Nucleo shows over USB, and what is missing said by name."""

import contextlib
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import BinaryIO

import pytest

from firmware_host import flashing
from firmware_host.errors import BoardError
from firmware_host.installation import install_command
from firmware_host.protocol import FIRMWARE_VERSION
from support.laboratories.commands import rig
from support.paths import IMAGE
from support.processes.full_disk import full_disk

PAGE = '<html><head><meta http-equiv="refresh" content="0; url=http://mbed.org/device/?code=%s0221066DFF53"/></head></html>'


def drive(folder: Path, code: str = "0770") -> Path:
    """A folder with the files a Nucleo's drive shows."""
    folder.mkdir(parents=True)
    (folder / "MBED.HTM").write_text(PAGE % code)
    (folder / "DETAILS.TXT").write_text("Version: 0221\r\nBuild: Mar 30 2015 16:07:31\r\n")
    return folder


class Probe(threading.Thread):
    """What stands behind the drive: takes the file that is copied there, and lets the drive come back without it."""

    def __init__(self, folder: Path, failure: str | None = None) -> None:
        super().__init__(daemon=True)
        self.taken = b""
        self._folder = folder
        self._failure = failure
        self._copied = folder / flashing.IMAGE_NAME

    def run(self) -> None:
        size = len(flashing.load_shipped_image())
        while not self._copied.exists() or self._copied.stat().st_size < size:
            time.sleep(0.002)
        self.taken = self._copied.read_bytes()
        gone = self._folder.rename(self._folder.with_name("unplugged"))
        time.sleep(0.1)
        (gone / flashing.IMAGE_NAME).unlink()
        if self._failure:
            (gone / "FAIL.TXT").write_text(self._failure)
        gone.rename(self._folder)


def refused(action: Callable[[], object]) -> BoardError:
    with pytest.raises(BoardError) as caught:
        action()
    return caught.value


def rig_board_flash(*arguments: str) -> subprocess.CompletedProcess[str]:
    return rig("board", "flash", *arguments)


def test_the_shipped_image_is_of_the_version_the_program_needs() -> None:
    assert FIRMWARE_VERSION.encode() in flashing.load_shipped_image()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda image: b"", "0 bytes"),
        (lambda image: image + bytes(flashing.FLASH_BYTES), "bytes"),
        (lambda image: b"\x7fELF" + image, "vectors of an STM32L432"),
        (lambda image: image.replace(FIRMWARE_VERSION.encode() + b"\0", b"9.9.9\0"), f"version {FIRMWARE_VERSION}"),
    ],
)
def test_another_image_is_refused(change: Callable[[bytes], bytes], why: str) -> None:
    error = refused(lambda: flashing.check_image(change(flashing.load_shipped_image())))
    assert error.name == "bad_image" and why in error.what


@pytest.mark.slow
def test_the_drive_takes_the_image(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    probe = Probe(nucleo)
    probe.start()
    flashing.flash_by_drive(flashing.load_shipped_image(), nucleo)
    probe.join()
    assert probe.taken == flashing.load_shipped_image()


@pytest.mark.slow
def test_an_earlier_failure_does_not_count(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    (nucleo / "FAIL.TXT").write_text("of yesterday")
    Probe(nucleo).start()
    flashing.flash_by_drive(flashing.load_shipped_image(), nucleo)


@pytest.mark.slow
def test_what_the_board_says_of_its_failure_is_passed_on(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    Probe(nucleo, "The interface firmware FAILED to reset/halt the target MCU\r\n").start()
    error = refused(lambda: flashing.flash_by_drive(flashing.load_shipped_image(), nucleo))
    assert error.name == "flash_failed" and "FAILED to reset/halt" in error.what and "\n" not in str(error)


@pytest.mark.slow
def test_a_board_that_does_not_take_the_image_is_not_taken_for_flashed(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    error = refused(lambda: flashing.flash_by_drive(flashing.load_shipped_image(), nucleo, timeout_s=0.2))
    assert error.name == "flash_unconfirmed" and "rig board info" in error.remedy


def test_a_drive_that_is_full(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    image = flashing.load_shipped_image()
    with full_disk(1000):
        error = refused(lambda: flashing.flash_by_drive(image, nucleo))
    assert error.name == "flash_failed" and "File too large" in error.what


def test_an_image_that_is_not_the_one_it_was_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shutil.copytree(IMAGE, tmp_path / "firmware" / "image")
    monkeypatch.setattr("firmware_host.flashing.resources.files", lambda package: tmp_path)
    shipped = tmp_path / "firmware" / "image" / flashing.IMAGE_NAME
    assert flashing.load_shipped_image() == shipped.read_bytes()
    changed = bytearray(shipped.read_bytes())
    changed[5000] ^= 1
    shipped.write_bytes(changed)
    error = refused(flashing.load_shipped_image)
    assert error.name == "bad_image" and flashing.sha256(bytes(changed)) in error.what


@pytest.mark.parametrize("laid", ["link", "endless", "pipe"])
def test_a_stick_that_passes_for_a_nucleo_s_drive_is_not_read_or_written_beyond_itself(
    tmp_path: Path, laid: str
) -> None:
    stick, precious = drive(tmp_path / "stick"), tmp_path / "precious"
    precious.write_text("mine", encoding="utf-8")
    if laid == "link":
        (stick / flashing.IMAGE_NAME).symlink_to(precious)
        error = refused(lambda: flashing.flash_by_drive(flashing.load_shipped_image(), stick))
        assert error.name == "flash_failed" and precious.read_text(encoding="utf-8") == "mine"
        return
    (stick / "MBED.HTM").unlink()
    if laid == "endless":
        (stick / "MBED.HTM").symlink_to("/dev/zero")
    else:
        os.mkfifo(stick / "MBED.HTM")
    assert refused(lambda: flashing.find_drive([stick])).name == "no_drive"


def test_the_drive_is_found_among_others(tmp_path: Path) -> None:
    stick, other = tmp_path / "stick", drive(tmp_path / "NODE_F302R8", code="0705")
    stick.mkdir()
    nothing = refused(lambda: flashing.find_drive([stick, other, tmp_path / "none"]))
    assert nothing.name == "no_drive" and "--drive PATH" in nothing.remedy

    nucleo = drive(tmp_path / "NODE_L432KC")
    assert flashing.find_drive([stick, other, nucleo]) == nucleo
    second = drive(tmp_path / "NODE_L432KC1")
    assert refused(lambda: flashing.find_drive([nucleo, second])).name == "several_drives"


@pytest.mark.slow
def test_another_drive_is_refused_by_name_before_anybody_is_asked(tmp_path: Path) -> None:
    (tmp_path / "stick").mkdir()
    drive(tmp_path / "NODE_F302R8", code="0705")
    for name, error in (("stick", "not_a_nucleo_drive"), ("NODE_F302R8", "not_a_nucleo_drive"), ("none", "no_drive")):
        done = rig_board_flash("--drive", str(tmp_path / name))
        assert done.returncode == 2 and done.stderr.startswith(f"rig: {error}: "), done
        assert done.stderr.count("\n") == 1
    assert list((tmp_path / "stick").iterdir()) == []


@pytest.mark.slow
def test_nobody_to_ask_is_a_refusal_and_yes_is_an_answer(tmp_path: Path) -> None:
    nucleo = drive(tmp_path / "NODE_L432KC")
    done = rig_board_flash("--drive", str(nucleo))
    assert done.returncode == 2 and "not_confirmed" in done.stderr and FIRMWARE_VERSION in done.stderr
    assert not (nucleo / flashing.IMAGE_NAME).exists()

    Probe(nucleo).start()
    done = rig_board_flash("--drive", str(nucleo), "--yes")
    assert done.returncode == 0 and f"flashed: firmware {FIRMWARE_VERSION}" in done.stdout, done


@pytest.mark.slow
def test_a_probe_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    error = refused(lambda: flashing.find_probe("no-such-probe"))
    assert error.name == "no_probe" and "no-such-probe" in error.what and "--drive" in error.remedy

    monkeypatch.setitem(sys.modules, "pyocd.core.helpers", None)  # as if the extra were not installed
    error = refused(flashing.find_probe)
    assert error.name == "flash_extra_missing" and install_command("flash") in error.remedy


class Chip:
    """A microcontroller at a probe, as far as programming it goes: what was done to it, in order."""

    def __init__(self, kilobytes: int = 256, package: int = flashing.UFQFPN32) -> None:
        self.done: list[str] = []
        self.contents = b""
        self.registers = {
            flashing.DEVICE_ID_REGISTER: 0x1000_6435,
            flashing.SIZE_REGISTER: 0xFFFF_0000 | kilobytes,
            flashing.PACKAGE_REGISTER: package,
        }

    def read32(self, address: int) -> int:
        return self.registers.get(address, 0)

    def read_memory_block8(self, address: int, size: int) -> list[int]:
        return list(self.contents[:size])

    def reset_and_halt(self) -> None:
        self.done.append("halted after a reset")

    def write32(self, address: int, value: int) -> None:
        self.done.append(f"0x{address:08x} = {value}")

    def reset(self) -> None:
        self.done.append("reset")


@pytest.mark.slow
def test_what_runs_on_the_board_is_stopped_by_a_reset_before_its_flash_is_erased(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chip = Chip()

    class Programmer:
        def __init__(self, session: SimpleNamespace, **options: object) -> None:
            assert options["chip_erase"] == "sector", "the calibrations stay"

        def program(self, file: BinaryIO, **options: object) -> None:
            chip.done.append("programmed")
            chip.contents = file.read()

    monkeypatch.setattr("pyocd.flash.file_programmer.FileProgrammer", Programmer)
    flashing._program(SimpleNamespace(target=chip), flashing.load_shipped_image())
    debug_bits_cleared = "0xe0042004 = 0"
    assert chip.done == ["halted after a reset", "programmed", debug_bits_cleared, "reset"]


@pytest.mark.slow
@pytest.mark.parametrize(("kilobytes", "package"), [(128, flashing.UFQFPN32), (256, 0x0B)], ids=["L432KB", "L433CC"])
def test_another_part_of_the_family_is_refused_before_it_is_touched(kilobytes: int, package: int) -> None:
    chip = Chip(kilobytes, package)
    error = refused(lambda: flashing._program(SimpleNamespace(target=chip), flashing.load_shipped_image()))
    assert error.name == "other_microcontroller" and f"{kilobytes} KB" in error.what and chip.done == []


@pytest.mark.slow
def test_the_probe_of_another_board_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from pyocd.board.board_ids import BOARD_ID_TO_INFO

    probe = SimpleNamespace(unique_id="0123", associated_board_info=BOARD_ID_TO_INFO[flashing.NUCLEO_CODE])
    monkeypatch.setattr("pyocd.core.helpers.ConnectHelper.get_all_connected_probes", lambda **options: [probe])
    assert flashing.find_probe() is probe
    probe.associated_board_info = BOARD_ID_TO_INFO["0705"]
    error = refused(flashing.find_probe)
    assert error.name == "other_microcontroller" and "F302R8" in error.what.upper()


@pytest.mark.slow
def test_no_script_of_the_working_folder_is_executed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "pyocd_user.py").write_text(f"open({str(tmp_path / 'trace')!r}, 'w')", encoding="utf-8")
    (tmp_path / "pyocd.yaml").write_text("user_script: pyocd_user.py\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    probe = SimpleNamespace(unique_id="0123", session=None, associated_board_info=None, create_associated_board=None)
    with contextlib.suppress(Exception):  # there is nothing to flash at this probe
        flashing.flash_by_probe(flashing.load_shipped_image(), probe)
    assert probe.session is not None and not (tmp_path / "trace").exists() and Path.cwd() == tmp_path


@pytest.mark.parametrize("works", ["under-reset", "halt", "neither"])
def test_a_board_that_sleeps_is_caught_under_reset_and_else_halted(monkeypatch: pytest.MonkeyPatch, works: str) -> None:
    from pyocd.core.exceptions import TransferFaultError

    tried: list[str] = []

    class Session:
        def __init__(self, probe: SimpleNamespace, options: dict[str, object]) -> None:
            self.mode = str(options["connect_mode"])

        def __enter__(self) -> "Session":
            tried.append(self.mode)
            if self.mode != works:
                raise TransferFaultError
            return self

        def __exit__(self, *error: object) -> None:
            pass

    monkeypatch.setattr("pyocd.core.session.Session", Session)
    monkeypatch.setattr(flashing, "_program", lambda session, image: None)
    probe = SimpleNamespace(unique_id="0123")
    if works == "neither":
        assert refused(lambda: flashing.flash_by_probe(b"", probe)).name == "flash_failed"
    else:
        flashing.flash_by_probe(b"", probe)
    assert tried == (["under-reset"] if works == "under-reset" else ["under-reset", "halt"])
