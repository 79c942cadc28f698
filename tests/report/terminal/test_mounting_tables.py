"""How the item was found to sit in each stage: on the screen, on the page, and on what a customer signs."""

from io import StringIO
from pathlib import Path

import numpy as np
from rich.console import Console

from rig.data.result_file import MountEntry, ResultDocument, write_result
from rig.page.page_state import PageState
from rig.report.certificate.dcc import digital_certificate
from rig.report.terminal.result_table import print_values
from rig.report.terminal.run_summary import ending
from rig.report.words.mounting_words import farthest_off, mount_lines
from rig.station.events import DocumentWritten
from support.documents.certified import add_comparison, certificate, read, result
from support.documents.dcc_rules import schema_faults
from support.page.scripted_runs import ABOUT

LINE = "mounting error in stage {}: {}° about x, {}° about y, {}° about z"
TOLD = [
    LINE.format(2, "0.401 ± 0.012", "−0.600 ± 0.020", "0.500 ± 0.012"),
    LINE.format(3, "0.0 ± 1.2", "0.100 ± 0.012", "0.000 ± 0.012"),  # what its sweeps do not tell about x
]


def entry(stage: int, turn_deg: tuple[float, float, float], std_deg: tuple[float, float, float]) -> MountEntry:
    turn, std = (tuple(np.radians(each).tolist()) for each in (turn_deg, std_deg))
    return MountEntry.model_validate({"stage": stage, "rotation_rad": turn, "std_rad": std})


def in_stages() -> ResultDocument:
    second = entry(2, (0.401, -0.6, 0.5), (0.006, 0.01, 0.006))
    third = entry(3, (0.0, 0.1, 0.0), (0.58, 0.006, 0.006))
    return add_comparison(result()).model_copy(update={"mounts": (second, third)})


def test_the_terminal_tells_every_stage_and_the_end_of_a_run_the_farthest() -> None:
    console = Console(width=200, record=True, file=StringIO())
    print_values(in_stages(), console)
    assert [line.rstrip() for line in console.export_text().splitlines() if "mounting error" in line] == TOLD
    said = ending(in_stages(), folder=None, everything="all", certificate=None, since=(), width=200)
    assert [line for line in said if "mounting error" in line] == [f"{TOLD[0]}; less in 1 other stage"]


def test_nothing_is_said_where_the_turns_tell_nothing_of_the_mounts() -> None:
    """One axis of the item for each stage: every angle is found as it was assumed, but for rounding."""
    unknown = entry(2, (1e-12, -2e-12, 0.0), (1.6, 1.6, 1.6))
    result = in_stages().model_copy(update={"mounts": (unknown,)})
    assert [*mount_lines(result), *farthest_off(result)] == []
    assert "was mounted in" not in read(certificate(result)).text


def test_certificates_tell_every_stage() -> None:
    found = certificate(in_stages())
    text, xml = read(found).text, digital_certificate(found)
    told = "; ".join(TOLD)
    assert f"The item was mounted in 3 stages. Relative to the first, with U (k = 2): {told}." in text
    assert told in xml.decode()
    assert schema_faults(xml) == []


def test_the_page_tells_every_stage(tmp_path: Path) -> None:
    write_result(in_stages(), tmp_path)
    shown = PageState(ABOUT)
    shown.take(DocumentWritten(tmp_path / "result.json"))
    assert shown.sections["mounts"] == TOLD


def test_no_mounting_is_reported_for_an_item_that_was_mounted_once(tmp_path: Path) -> None:
    found = add_comparison(result())
    assert "mounted in" not in read(certificate(found)).text
    write_result(found, tmp_path)
    shown = PageState(ABOUT)
    shown.take(DocumentWritten(tmp_path / "result.json"))
    assert shown.sections["mounts"] == []
