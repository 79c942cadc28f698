"""How figures look: alike wherever they are drawn."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def style() -> Iterator[None]:
    """What is drawn within looks alike, and its SVG has the same bytes each time.

    matplotlib takes its settings from a file in the working folder, which may be somebody else's run folder and let
    LaTeX set the words. So they are put back to its own defaults.
    """
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update({"font.size": 9, "svg.hashsalt": "rig", "axes.grid": True, "grid.alpha": 0.3})
        yield
