"""The style of figures, the same wherever they are drawn."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def use_style() -> Iterator[None]:
    """Draw alike within this block, with the same bytes of SVG each time.

    matplotlib reads settings from a file in the working folder, which may be another user's run folder and let LaTeX
    set the text. So its own defaults are restored.
    """
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update({"font.size": 9, "svg.hashsalt": "rig", "axes.grid": True, "grid.alpha": 0.3})
        yield
