"""What the libraries of linear algebra and of fits refuse becomes an error by name, whatever reckons with them."""

from collections.abc import Iterator
from contextlib import contextmanager

from rig.errors import Fault

LIBRARIES = ("numpy.", "scipy.")


@contextmanager
def solvable() -> Iterator[None]:
    """Raises Fault `not_solvable` where NumPy or SciPy gives a solution up; a mistake of our own code stays one."""
    try:
        yield
    except ValueError as error:  # of which NumPy's LinAlgError is one
        if not _of_a_library(error):
            raise
        raise Fault(
            "not_solvable",
            f"the readings and what is known of their motion have no solution together ({error})",
            "Look whether the recording is of this movement and undamaged; record it again, or resume the run if it "
            "was interrupted",
        ) from error


def _of_a_library(error: ValueError) -> bool:
    """Whether it was raised inside one of them."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and str(trace.tb_frame.f_globals.get("__name__")).startswith(LIBRARIES)
