"""pandas for those who have it: the extra `pandas` brings it, and nothing is loaded before a table is asked for."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rig.errors.extras import missing_extra

if TYPE_CHECKING:
    from pandas import DataFrame


def frame(columns: Mapping[str, Any], index: Sequence[Any], name: str) -> "DataFrame":
    """A table of `columns` (n,) by name over an `index` (n,) of that `name`. Raises Refused `missing_extra`."""
    try:
        import pandas
    except ImportError as error:
        raise missing_extra(error, "pandas") from error
    return pandas.DataFrame(dict(columns), index=pandas.Index(index, name=name))
