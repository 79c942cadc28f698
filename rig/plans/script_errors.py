"""Errors in the code of a user's own procedure, which are not defects of the rig."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.errors import ProblemError, Refused

ENDING_REMEDY = 'Do not let it end the program: put what runs it alone below `if __name__ == "__main__":`'


@contextmanager
def script_errors(what: str, remedy: str = "Correct the script") -> Iterator[None]:
    """Raise Refused `script_failed` for any error in the block except Fault and Refused.

    The message contains `what`, and the error with its position. A script that ends the program is refused as well,
    because its exit status would be taken for a verdict.
    """
    try:
        yield
    except ProblemError:
        raise
    except SystemExit as ended:
        raise Refused("script_failed", f"{what} ({_reason(ended)})", ENDING_REMEDY) from ended
    except Exception as error:
        raise Refused("script_failed", f"{what} ({_reason(error)})", remedy) from error


def _reason(error: BaseException) -> str:
    """Return the error and the innermost position at which it was raised."""
    message = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    places = traceback.extract_tb(error.__traceback__)[2:]  # the first two are the rig's own
    return f"{message}; {Path(places[-1].filename).name}, line {places[-1].lineno}" if places else message
