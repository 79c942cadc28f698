"""Where the things lie that tests read."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
CONFIGS = ROOT / "configs"
DEMO = CONFIGS / "demo.yaml"
DOCS = ROOT / "docs"
FIRMWARE = ROOT / "firmware_host" / "firmware"
IMAGE = FIRMWARE / "image"
FIXTURES = ROOT / "tests" / "fixtures" / "af3b9f0"  # runs recorded by the rig of that commit
