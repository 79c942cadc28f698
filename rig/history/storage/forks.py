"""No connection crosses a fork: neither SQLite's locks nor a server's session do.

Source: https://sqlite.org/howtocorrupt.html, 2.6; SQLAlchemy, "Using connection pools with multiprocessing".
"""

import os
from weakref import WeakSet

from sqlalchemy import Engine, Pool

_engines: "WeakSet[Engine]" = WeakSet()
_of_the_parent: list[Pool] = []


def kept_from_children(engine: Engine) -> Engine:
    """Return the engine, which in a forked process begins with connections of its own."""
    _engines.add(engine)
    return engine


def _leave_to_the_parent() -> None:
    for engine in list(_engines):
        _of_the_parent.append(engine.pool)  # not even closed here, which would work on the parent's files
        engine.dispose(close=False)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_the_parent)
