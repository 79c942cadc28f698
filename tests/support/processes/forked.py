"""Processes that run a function during a test, forked from one that has imported the needed modules."""

import multiprocessing
from multiprocessing.context import ForkServerContext

# There is one such process for all tests, so it has what any of them needs. Before Python 3.12 it finds the rig and
# what is installed, not the files next to the tests, and it does not report a missing module.
IMPORTED = (
    *("pytest", "h5py", "rig.data.recording.run_file", "rig.data.result_file"),
    *("rig.history.store", "rig.report.kinds.kind_registry"),
    *("sqlalchemy.dialects.sqlite", "sqlalchemy.dialects.postgresql", "psycopg"),
    *("rig.turners.servo.servo_driver", "rig.world.servo.bus"),
)


def find_fork_server() -> ForkServerContext:
    """Return the context that forks such processes."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(IMPORTED))
    return context
