"""Engines that a forked process may inherit: the new process opens its own connections.

Neither SQLite's locks nor a server's session survive a fork.

Source: https://sqlite.org/howtocorrupt.html, 2.6; SQLAlchemy, "Using connection pools with multiprocessing".
"""

import os
from weakref import WeakSet

from sqlalchemy import Engine, Pool

_engines: "WeakSet[Engine]" = WeakSet()
_parent_pools: list[Pool] = []


def kept_from_children(engine: Engine) -> Engine:
    """Return the engine. A forked process that inherits the engine opens new connections."""
    _engines.add(engine)
    return engine


def _leave_to_the_parent() -> None:
    for engine in list(_engines):
        _parent_pools.append(engine.pool)  # not closed here: that would act on the parent's files
        engine.dispose(close=False)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_the_parent)
