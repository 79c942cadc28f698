"""Who may answer on a station's page, asked over a real socket."""

import http.client
import json
import threading
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from urllib.parse import urlsplit

import pytest

from rig.batch.batch_state import BatchPart
from rig.batch.operators import Operator
from rig.batch.page_operator import PageOperator
from rig.page.server.control import Control
from rig.page.server.sections import Sections
from rig.page.server.serving import Page, PageAddress, serving
from rig.station.questions import Question
from support.processes.waiting import PATIENCE_S, wait_for

TOKEN = "a-token-of-two-and-twenty"
Asking = Callable[..., int]


@pytest.fixture
def answers() -> "SimpleQueue[str | None]":
    return SimpleQueue()


@pytest.fixture
def ask(answers: "SimpleQueue[str | None]") -> Iterator[Asking]:
    """Asks the page of a station that waits for a number."""
    sections, control = Sections(), Control(may_answer=False)
    voice = PageOperator(sections, control)
    with serving(sections, control, None, PageAddress(port=0, token=TOKEN), Page("station.html", voice.routes)) as url:
        port = urlsplit(url).port or 0

        def asked(method: str, path: str, body: object = None, **headers: str) -> int:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
            sent = {"Authorization": f"Bearer {TOKEN}", **headers}
            connection.request(method, path, json.dumps(body), {name: text for name, text in sent.items() if text})
            status = connection.getresponse().status
            connection.close()
            return status

        number = Question("number", "part 1, serial number:")
        threading.Thread(target=lambda: answers.put(voice.answer(number)), daemon=True).start()
        wait_for(lambda: b'"number":1' in sections.whole(), "the question")
        yield asked


@pytest.mark.slow
def test_an_answer_needs_the_token_the_page_and_the_question(ask: Asking, answers: "SimpleQueue[str | None]") -> None:
    right = {"number": 1, "text": " G-001 "}
    assert ask("POST", "/say", right, Authorization="") == 403
    assert ask("POST", "/say", right, Origin="http://evil.example") == 403
    assert ask("GET", "/say") == 405
    assert ask("POST", "/say", {**right, "number": 2}) == 409
    unfit = [{**right, "text": "a\nb"}, {**right, "text": "x" * 201}, {"number": True, "text": "x"}]
    for wrong in (list[str](), {"number": 1}, *unfit):
        assert ask("POST", "/say", wrong) == 400
    assert answers.empty()
    assert ask("POST", "/say", right) == 202
    assert answers.get(timeout=PATIENCE_S) == "G-001"
    assert ask("POST", "/say", right) == 409
    assert ask("POST", "/stop") == 409  # nothing runs


def test_a_page_that_is_lost_mounts_nothing_and_agrees_to_nothing() -> None:
    control = Control(may_answer=False)
    voice = PageOperator(Sections(), control)
    control.leave()
    assert voice.answer(Question("number", "part 1, serial number:")) is None
    operator = Operator(voice)
    assert operator.next_part([]) is None
    assert not operator.is_mounted(BatchPart(1, "G-001", "01-G-001", "2026-11-25T08:00:00+00:00"))
    assert not operator.agrees(("The arm will move.",), "start")
