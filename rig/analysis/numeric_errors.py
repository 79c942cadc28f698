"""The translation of errors of numerical libraries into a Fault."""

from collections.abc import Iterator
from contextlib import contextmanager

from rig.errors import Fault

LIBRARIES = ("numpy.", "scipy.")


@contextmanager
def solvable() -> Iterator[None]:
    """Raise Fault `not_solvable` for a ValueError of NumPy or SciPy in the block, not for one of our own code."""
    try:
        yield
    except ValueError as error:  # includes NumPy's LinAlgError
        if not _is_of_library(error):
            raise
        raise Fault(
            "not_solvable",
            f"the readings and their stated motion have no common solution ({error})",
            "Check that the recording is of this movement and undamaged; record it again, or resume the run if it "
            "was interrupted",
        ) from error


def _is_of_library(error: ValueError) -> bool:
    """Return whether NumPy or SciPy raised the error."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and str(trace.tb_frame.f_globals.get("__name__")).startswith(LIBRARIES)
