"""A Dask cluster of this computer."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def local_cluster(**of: Any) -> Iterator[Any]:
    from distributed import LocalCluster

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # distributed's own, about the loop it closes
        with LocalCluster(threads_per_worker=1, dashboard_address=None, **of) as cluster:  # type: ignore[no-untyped-call]
            yield cluster
