"""Draw the pictures of wiring, axes and motion that the pages show: `make drawings`."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from axes import home, mounting  # noqa: E402
from by_hand import by_hand  # noqa: E402
from choice import choice  # noqa: E402
from sweep import sweep  # noqa: E402
from wiring import wirings  # noqa: E402


def drawings() -> dict[str, str]:
    """Every drawing as SVG text, by the name of its file."""
    all_of_them = {
        **wirings(),
        "mounting.svg": mounting(),
        "home-pose.svg": home(),
        "sweep.svg": sweep(),
        "own-imu.svg": choice(),
        "by-hand.svg": by_hand(),
    }
    return {name: drawing.text() for name, drawing in all_of_them.items()}


if __name__ == "__main__":
    for name, text in drawings().items():
        (HERE / name).write_text(text, encoding="utf-8")
