"""`rig check`: connect and check. It only receives, so nothing moves and no program on the arm is stopped."""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.errors import Problem, Refused, RigError
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.commands.configured import Configured

Tell = Callable[[str], None]


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig check`."""
    add_config(parser)
    add_script(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Check board, sensors and turner; print the devices present and missing. Return 0 if a run could start, else 2.

    With `--json` print everything at the end, in the schema "rig.check/1".
    """
    lines: list[str] = []
    tell: Tell = lines.append if options.json else say
    from rig.commands.configured import open_configured

    with ExitStack() as stack:
        configured = stack.enter_context(open_configured(options.config, options.overrides, options.script))
        if configured.loaded.simulated:
            stack.enter_context(run_simulated_laboratory(configured.loaded.text))
        checks = [_check_board, _check_instruments, _check_turner]
        missing = [problem for check in checks for problem in _catch_problem(check, configured, tell)]
    if options.json:
        problems = [problem._asdict() for problem in missing]
        document = {"schema": "rig.check/1", "ready": not missing, "seen": lines, "missing": problems}
        print(json.dumps(document, indent=2))
        return 2 if missing else 0
    for problem in missing:
        say(f"missing: {problem}", file=sys.stderr)
    say(f"not ready: {len(missing)} to correct" if missing else "ready")
    return 2 if missing else 0


def _catch_problem(
    check: "Callable[[Configured, Tell], list[Problem]]", configured: "Configured", tell: Tell
) -> list[Problem]:
    """Return the problems of one check, including an error that ended it."""
    try:
        return check(configured, tell)
    except RigError as error:
        return [error.problem]


def _check_board(configured: "Configured", tell: Tell) -> list[Problem]:
    """Return the problems of board, firmware and sensors; `tell` gets a line for each device that answers."""
    from firmware_host.client import Board
    from rig.board.identify import (
        find_sensor,
        read_stored_calibration,
        refuse_other_firmware,
        refusing,
        require_board_section,
    )
    from rig.commands.laboratory.claims import claim_board

    config = configured.loaded.config
    missing: list[Problem] = []
    if not config.parts_on_board:
        return missing
    section = require_board_section(config)
    with refusing(), claim_board(section.port), Board(section.port, section.baud, lambda batch: None) as board:
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


def _check_instruments(configured: "Configured", tell: Tell) -> list[Problem]:
    """Return the problems of sensors with a port of their own, without changing their memories."""
    from rig.commands.laboratory.claims import claim_sensor
    from rig.sensors.errors import SensorError
    from rig.sensors.sensor_registry import group_by_port

    missing: list[Problem] = []
    for port, kind, sections in group_by_port(configured.loaded.config.sensors):
        name = ", ".join(sections)
        try:
            with claim_sensor(name, port):
                for finding in kind.look(sections):
                    if isinstance(finding, str):
                        tell(f"sensor {name}: {finding}")
                    else:
                        missing.append(finding.problem)
        except (Refused, SensorError) as error:
            missing.append(error.problem)
    return missing


def _check_turner(configured: "Configured", tell: Tell) -> list[Problem]:
    from rig.motion.plan_warnings import doubts
    from rig.turners.turner_registry import kind_of

    section = configured.loaded.config.turner
    kind = kind_of(section)
    report = kind.look(section)
    tell(f"{kind.words.short} at {report.host}: {report.words}")
    tell(kind.stance(report))
    plan = configured.phase.plan(report.state.q_rad)
    for doubt in doubts(plan):
        tell(f"note: {doubt}")
    return [*_find_other_claims(section.address), *kind.problems([plan], section, report)]


def _find_other_claims(host: str) -> list[Problem]:
    """Return a problem if another rig has claimed the arm. No claim is kept, as a check disturbs no other rig."""
    from rig.commands.laboratory.claims import claim_arm

    if not host:
        return []
    try:
        with claim_arm(host):
            return []
    except Refused as refused:
        return [refused.problem]
