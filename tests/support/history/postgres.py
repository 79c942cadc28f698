"""A PostgreSQL for tests: a new cluster in its own folder, reached by a socket there, and removed afterwards."""

import itertools
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg

PROGRAMS = Path("/usr/lib/postgresql")  # where Debian has them, by version
FAST = ("-c", "fsync=off", "-c", "listen_addresses=", "-c", "shared_buffers=16MB", "-c", "max_connections=100")
_numbers = itertools.count()


@contextmanager
def postgresql() -> Iterator[str]:
    """Yield its URL. If the tests run as root, it runs as the user `postgres`, because PostgreSQL refuses root."""
    folders = sorted(PROGRAMS.glob("*/bin"), key=lambda path: int(path.parent.name))
    assert folders, "PostgreSQL is not installed: apt-get install postgresql"
    programs = folders[-1]
    folder = Path(tempfile.mkdtemp(prefix="rig-pg-"))  # short: the path of a socket may have a hundred characters
    other: dict[str, Any] = {}
    try:
        if os.geteuid() == 0:
            user = pwd.getpwnam("postgres")
            os.chown(folder, user.pw_uid, user.pw_gid)
            other = {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
        data = folder / "data"
        settled: dict[str, Any] = {"cwd": folder, "stdout": subprocess.DEVNULL, "timeout": 120, **other}
        make = (programs / "initdb", "-D", data, "-A", "trust", "-U", "rig", "-N", "--no-locale", "-E", "UTF8")
        subprocess.run(list(map(str, make)), check=True, **settled)
        control = [str(programs / "pg_ctl"), "-D", str(data)]
        options = " ".join((*FAST, "-k", str(folder)))
        subprocess.run([*control, "-w", "-l", str(folder / "log"), "-o", options, "start"], check=True, **settled)
        try:
            yield f"postgresql://rig@/postgres?host={folder}"
        finally:
            subprocess.run([*control, "-m", "immediate", "stop"], check=True, **settled)
    finally:
        shutil.rmtree(folder)


def new_database(server: str) -> str:
    """Make an empty database in the cluster with the URL `server`, and return its URL.

    It takes a tenth of the time of a new cluster, and nothing that a test does to its tables reaches another database.
    """
    name = f"history_{next(_numbers)}"
    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}".encode())
    return server.replace("/postgres?", f"/{name}?")
