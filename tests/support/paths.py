"""Paths of the files that tests read."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
CONFIGS = ROOT / "configs"
DEMO = CONFIGS / "demo.yaml"
DOCS = ROOT / "docs"
FIRMWARE = ROOT / "firmware_host" / "firmware"
IMAGE = FIRMWARE / "image"
RECORDINGS = ROOT / "tests" / "fixtures" / "recordings"  # frozen: see support.recordings.frozen
