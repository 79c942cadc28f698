"""The operator of a station on its page: the open question, and the answer from a browser."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from rig.batch.status import Now, Present, last
from rig.page.server.application import body_of, require_token
from rig.page.server.control import Control
from rig.page.server.guard import Door
from rig.page.server.sections import Sections
from rig.page.server.serving import Page, PageAddress, serving
from rig.station.questions import Question

MAX_ANSWER = 200  # characters
CHECK_INTERVAL_S = 0.5  # of whether the page still exists


class PageOperator:
    """The `Voice` of an operator who answers on a page; the page also shows the station's state."""

    def __init__(self, sections: Sections, control: Control) -> None:
        self._sections, self._control = sections, control
        self._changed = threading.Condition()
        self._number = 0
        self._open = False
        self._text = ""
        sections.put(asked=None)

    def hear(self, now: Now) -> None:
        """Show a change of the station's state."""
        self._sections.put(now=asdict(now))

    def answer(self, question: Question) -> str | None:
        """Return a browser's answer; None if the page has ended."""
        with self._changed:
            self._number, self._open, self._text = self._number + 1, True, ""
            choices = [asdict(choice) for choice in question.choices]
            self._sections.put(asked={"number": self._number, **asdict(question), "choices": choices})
            try:
                while self._open and not self._control.gone:
                    self._changed.wait(CHECK_INTERVAL_S)
                return None if self._open else self._text
            finally:
                self._open = False
                self._sections.put(asked=None)

    def takes(self, number: int, text: str) -> bool:
        """Accept `text` as the answer to the question with this number; return False if that question is closed."""
        with self._changed:
            if not self._open or number != self._number:
                return False
            self._text, self._open = text.strip(), False
            self._changed.notify_all()
            return True

    def routes(self, door: Door) -> list[Route]:
        """Return the routes for an answer and for the stop."""

        async def say(request: Request) -> Response:
            content = await body_of(request)
            try:
                number, text = json.loads(content)["number"], json.loads(content)["text"]
            except (ValueError, TypeError, KeyError):
                number, text = None, None
            if type(number) is not int or not isinstance(text, str) or len(text) > MAX_ANSWER or not text.isprintable():
                return PlainTextResponse('expected: {"number": 1, "text": "the answer"}\n', 400)
            if not self.takes(number, text):
                return PlainTextResponse("this question is not open any more\n", 409)
            return Response(status_code=202)

        async def stop(request: Request) -> Response:
            if not self._control.stop():
                return PlainTextResponse("nothing to stop\n", 409)
            return Response(status_code=202)

        return [
            Route("/say", require_token(door, say), methods=["POST"]),
            Route("/stop", require_token(door, stop), methods=["POST"]),
        ]


@contextmanager
def open_page(present: Present, address: PageAddress) -> Iterator[tuple[PageOperator, str]]:
    """Open the page that shows `present` during the block; yield the page and its URL.

    The page's last state shows how the station ended. Raise Refused `page_address`.
    """
    sections, control = Sections(), Control(may_answer=False)
    voice = PageOperator(sections, control)
    with serving(sections, control, None, address, Page("station.html", voice.routes)) as url:
        present.listeners = (*present.listeners, voice.hear)
        voice.hear(present.now)
        try:
            with control.stoppable():
                yield voice, url
        finally:
            voice.hear(last(present.now))
