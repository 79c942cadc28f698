"""The common style of all figures."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def use_style() -> Iterator[None]:
    """Draw in one style within this block, with the same bytes of SVG each time.

    The library's defaults are restored, because matplotlib reads settings from a file in the working folder, which may
    be another user's run folder and start LaTeX.
    """
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update({"font.size": 9, "svg.hashsalt": "rig", "axes.grid": True, "grid.alpha": 0.3})
        yield
