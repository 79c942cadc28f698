"""`rig board flash`: write this program's firmware onto the board."""

from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path

from firmware_host import flashing
from firmware_host.protocol import FIRMWARE_VERSION
from rig.board.identify import changing, refusing
from rig.station.confirm import require_agreement
from rig.station.plain_text import say


def flash(options: Namespace) -> int:
    """Flash the shipped image, through the board's debug probe or by a copy to its USB drive; return 0."""
    with refusing():
        image = flashing.load_shipped_image()
        carry_out: Callable[[], object]
        if options.drive is not None:
            target = Path(options.drive) if options.drive else flashing.find_drive()
            flashing.refuse_other_drive(target)
            carry_out = partial(flashing.flash_by_drive, image, target)
            route, calibrations = f"the drive {target}", "may be lost: read them out first"
        else:
            probe = flashing.find_probe(options.probe)
            carry_out = partial(flashing.flash_by_probe, image, probe)
            route, calibrations = f"the debug probe {probe.unique_id}", "stay"
    require_agreement(
        [
            f"The board at {route} gets the firmware {FIRMWARE_VERSION} ({len(image)} bytes).",
            f"SHA-256 {flashing.sha256(image)}.",
            f"Nothing else may use the board meanwhile. Calibrations it has stored {calibrations}.",
        ],
        "flash",
        options.yes,
    )
    with changing():
        carry_out()
    say(f"flashed: firmware {FIRMWARE_VERSION}, SHA-256 {flashing.sha256(image)}; see it with `rig board info CONFIG`")
    return 0
