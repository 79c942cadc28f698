"""The client of a Dask scheduler, which distributes the work over a cluster."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.errors import Refused

if TYPE_CHECKING:
    from distributed import Client


@contextmanager
def connect_client(address: str) -> Iterator["Client"]:
    """Connect to the scheduler at `address` during the block. Raise Refused `missing_extra`, `no_cluster`."""
    from rig.errors.extras import requiring

    with requiring("dask"):
        from distributed import Client
    try:
        client = Client(address, timeout="5s")
    except (OSError, ValueError) as error:
        raise Refused(
            "no_cluster", f"no Dask scheduler answers at {address} ({error})", "Start one with `dask scheduler`"
        ) from error
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # the fault `cluster_lost` says it in one line
    with client:
        yield client
