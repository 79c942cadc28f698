"""`rig check`: connect and look. Receives only, so nothing moves and no program on the arm is stopped."""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.commands.laboratory.laboratory import simulated_laboratory
from rig.errors import Problem, Refused, RigError
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.commands.configured import Configured

Tell = Callable[[str], None]


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig check`."""
    add_config(parser)
    add_script(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Look at the board and the arm; print what is there and what is missing. 0 when a run could start, else 2.

    With `--json` all of it at the end, of schema "rig.check/1".
    """
    seen: list[str] = []
    tell: Tell = seen.append if options.json else say
    from rig.commands.configured import configured_here

    with ExitStack() as stack:
        found = stack.enter_context(configured_here(options.config, options.overrides, options.script))
        if found.loaded.simulated:
            stack.enter_context(simulated_laboratory(found.loaded.text))
        looks = [_look_at_board, _look_at_instruments, _look_at_turner]
        missing = [problem for look_at in looks for problem in _named(look_at, found, tell)]
    if options.json:
        problems = [problem._asdict() for problem in missing]
        document = {"schema": "rig.check/1", "ready": not missing, "seen": seen, "missing": problems}
        print(json.dumps(document, indent=2))
        return 2 if missing else 0
    for problem in missing:
        say(f"missing: {problem}", file=sys.stderr)
    say(f"not ready: {len(missing)} to correct" if missing else "ready")
    return 2 if missing else 0


def _named(
    look_at: "Callable[[Configured, Tell], list[Problem]]", configured: "Configured", tell: Tell
) -> list[Problem]:
    """The problems found, including the one that ended the looking."""
    try:
        return look_at(configured, tell)
    except RigError as error:
        return [error.problem]


def _look_at_board(configured: "Configured", tell: Tell) -> list[Problem]:
    from firmware_host.client import Board
    from rig.board.identify import (
        find_sensor,
        read_stored_calibration,
        refuse_other_firmware,
        refusing,
        require_board_section,
    )
    from rig.commands.laboratory.claims import claimed_board

    config = configured.loaded.config
    missing: list[Problem] = []
    if not config.parts_on_board:
        return missing
    section = require_board_section(config)
    with refusing(), claimed_board(section.port), Board(section.port, section.baud, lambda batch: None) as board:
        identity = board.identity
        tell(f"board at {section.port}: {identity.unique_id}, firmware {identity.firmware}")
        try:
            refuse_other_firmware(identity)
        except RigError as error:
            missing.append(error.problem)
        for name, part in config.parts_on_board.items():
            try:
                info = find_sensor(identity, name, part)
                tell(f"sensor {name}: {info.part}, identity register 0x{info.who_am_i:02x}")
                if configured.phase.procedure.reads_corrected and name in config.to_calibrate:
                    stored = read_stored_calibration(board, name, config.to_calibrate[name])
                    tell(f"sensor {name}: calibrated on {stored.calibration.written_utc:%Y-%m-%d}")
            except RigError as error:
                missing.append(error.problem)
    return missing


def _look_at_instruments(configured: "Configured", tell: Tell) -> list[Problem]:
    """The sensors with a port of their own; nothing in their memories is changed."""
    from rig.commands.laboratory.claims import claimed_sensor
    from rig.sensors.errors import SensorError
    from rig.sensors.registry import group_by_port

    missing: list[Problem] = []
    for port, kind, sections in group_by_port(configured.loaded.config.sensors):
        name = ", ".join(sections)
        try:
            with claimed_sensor(name, port):
                for seen in kind.look(sections):
                    if isinstance(seen, str):
                        tell(f"sensor {name}: {seen}")
                    else:
                        missing.append(seen.problem)
        except (Refused, SensorError) as error:
            missing.append(error.problem)
    return missing


def _look_at_turner(configured: "Configured", tell: Tell) -> list[Problem]:
    from rig.motion.doubts import doubts
    from rig.turners.registry import kind_of

    section = configured.loaded.config.turner
    kind = kind_of(section)
    report = kind.look(section)
    tell(f"{kind.words.short} at {report.host}: {report.words}")
    tell(kind.stance(report))
    plan = configured.phase.plan(report.state.q_rad)
    for doubt in doubts(plan):
        tell(f"note: {doubt}")
    return [*_claims_of_others(section.address), *kind.problems([plan], section, report)]


def _claims_of_others(host: str) -> list[Problem]:
    """A problem if another rig has the arm; looking at it disturbs nobody, so it is claimed for no longer than this."""
    from rig.commands.laboratory.claims import claimed_arm

    if not host:
        return []
    try:
        with claimed_arm(host):
            return []
    except Refused as refused:
        return [refused.problem]
