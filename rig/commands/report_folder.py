"""The folder into which a command writes reports or pictures."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.errors import Refused
from rig.errors.extras import requiring


@contextmanager
def refuse_unwritable(folder: Path, option: str = "--out") -> Iterator[None]:
    """Raise Refused `report_folder` if the block cannot write into the folder; its remedy names the `option`."""
    try:
        yield
    except OSError as error:
        raise Refused(
            "report_folder", f"{folder} cannot be written: {error}", f"Choose another with {option}"
        ) from error


def draw_into(folder: Path, draw: Callable[[Path], list[Path]], option: str) -> list[Path]:
    """Draw into a folder and return the files. Raise Refused `missing_extra`, and what `refuse_unwritable` raises."""
    with requiring("study"):
        import matplotlib  # noqa: F401
    with refuse_unwritable(folder, option):
        folder.mkdir(parents=True, exist_ok=True)
        return draw(folder)
