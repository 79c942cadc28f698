"""pandas tables: the extra `pandas` installs the library, which is loaded on demand."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rig.errors.extras import requiring

if TYPE_CHECKING:
    from pandas import DataFrame


def frame(columns: Mapping[str, Any], index: Sequence[Any], name: str) -> "DataFrame":
    """Return a table of `columns` (n,) by name over the `index` (n,) called `name`. Raise Refused `missing_extra`."""
    with requiring("pandas"):
        import pandas
    return pandas.DataFrame(dict(columns), index=pandas.Index(index, name=name))
