"""The feed of the floor's page: the history is read twice a second, in a thread of its own."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError

from rig.errors import Refused
from rig.errors.quoting import shorten
from rig.floor import floor_content
from rig.history import stations
from rig.history.storage import schema
from rig.history.storage.address import HistoryAddress
from rig.history.store import History, open_history
from rig.page.server.sections import Sections

POLL_S = 0.5  # a dead rig (3.5 s) must be shown as such within 5 s


@contextmanager
def polled_feed(address: HistoryAddress) -> Iterator[Sections]:
    """Keep a feed up to date during the block, from a history that is only read."""
    feed, over = Sections(), threading.Event()
    feed.put(history={"label": address.label, "silent": None})
    thread = threading.Thread(target=_watch_history, args=(address, feed, over), name="floor", daemon=True)
    thread.start()
    try:
        yield feed
    finally:
        over.set()
        thread.join(POLL_S)


def _watch_history(address: HistoryAddress, feed: Sections, over: threading.Event) -> None:
    """Feed the page from the history; after an error show it and try again."""
    while not over.is_set():
        try:
            with open_history(address) as history:
                feed.put(history={"label": address.label, "silent": None})
                _follow(history, feed, over)
        except Exception as error:  # the page shows it, and the thread tries again
            why = error.what if isinstance(error, Refused) else f"{type(error).__name__}: {shorten(str(error))}"
            feed.put(history={"label": address.label, "silent": why})
            over.wait(POLL_S)


def _follow(history: History, feed: Sections, over: threading.Event) -> None:
    """Feed the page from an open history: the stations at every look, past results after new entries."""
    before: object = None
    while not over.is_set():
        today = datetime.now(UTC).date()
        feed.put(**floor_content.rigs(*stations.heard(history.engine)))
        version = today, _count_entries(history)
        if version != before:  # trends of a long history take longer than a second
            before = version
            feed.put(**_read_past(history, today))
        over.wait(POLL_S)


def _read_past(history: History, today: date) -> dict[str, Any]:
    """Return the past calibrations; if rows cannot be read, only the error, so that the rigs are shown nevertheless."""
    try:
        pasts = history.calibrations()
        recalls = floor_content.recalls(pasts, today)
        tables = {
            "today": floor_content.todays(pasts, today),
            "standards": floor_content.standards(pasts),
            "recalls": recalls,
        }
    except SQLAlchemyError:
        raise  # the history does not answer
    except Exception as error:
        return {"unread": f"{type(error).__name__}: {shorten(str(error))}"}
    return {**tables, "unread": None}


def _count_entries(history: History) -> tuple[int, int]:
    """Return the numbers of calibrations and of voided ones; one of them grows with every entry of the history."""
    counts = (select(func.count()).select_from(table) for table in (schema.calibration, schema.voided))
    with history.engine.connect() as connection:
        calibrations, voided = (int(connection.scalar(question) or 0) for question in counts)
    return calibrations, voided
