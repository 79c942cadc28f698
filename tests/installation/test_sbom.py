"""`make sbom` lists what is installed: all that is locked, by the versions that are there."""

import json
import subprocess
from importlib.metadata import version

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from support.paths import ROOT

pytestmark = pytest.mark.slow


@pytest.mark.proof
@pytest.mark.thorough
def test_the_bill_of_materials_lists_all_that_is_locked() -> None:
    subprocess.run(["make", "sbom"], cwd=ROOT, check=True, capture_output=True)
    bill = json.loads((ROOT / "build" / "sbom.json").read_text(encoding="utf-8"))
    assert bill["bomFormat"] == "CycloneDX" and bill["metadata"]["component"]["name"] == "calibration-rig"
    listed = {canonicalize_name(component["name"]): component["version"] for component in bill["components"]}
    lines = (ROOT / "requirements" / "demo.txt").read_text(encoding="utf-8").splitlines()
    locked = [Requirement(line.rstrip(" \\")) for line in lines if line[:1].isalpha()]
    here = [each.name for each in locked if each.marker is None or each.marker.evaluate()]
    assert {name: listed.get(canonicalize_name(name)) for name in here} == {name: version(name) for name in here}
