"""Whoever opens connections to the page takes neither the operator's place nor what the rig itself needs."""

import asyncio
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from rig.page.about import About
from rig.page.page_state import PageState
from rig.page.server.connections import MAX_STRANGERS, MAX_TRUSTED, Connections
from rig.page.server.control import Control
from rig.page.server.feed import Feed
from rig.page.server.serving import PageAddress, serving
from support.page.flood import alive, half_a_request, open_request
from support.processes.waiting import PATIENCE_S, wait_for


@contextmanager
def page(folder: Path) -> Iterator[str]:
    with serving(Feed(PageState(About("", ""))), Control(may_answer=False), folder, PageAddress(port=0)) as url:
        yield url


def status(url: str, method: str, path: str, **headers: str) -> int:
    place = urlsplit(url)
    connection = HTTPConnection(place.hostname or "", place.port, timeout=PATIENCE_S)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    connection.close()
    return answer.status


@pytest.mark.slow
def test_half_requests_hold_few_descriptors_and_the_page_answers_all_the_same(tmp_path: Path) -> None:
    with ExitStack() as held:
        url = held.enter_context(page(tmp_path))
        many = [held.enter_context(half_a_request(url)) for _ in range(400)]
        wait_for(lambda: sum(map(alive, many)) <= MAX_STRANGERS, "that only so many are left")
        assert alive(many[-1])
        token = {"Authorization": f"Bearer {urlsplit(url).fragment}"}
        assert (status(url, "GET", "/"), status(url, "POST", "/stop", **token)) == (200, 409)


@pytest.mark.slow
def test_an_address_that_opens_many_loses_its_own_and_no_others(tmp_path: Path) -> None:
    with ExitStack() as held:
        url = held.enter_context(page(tmp_path))
        other = held.enter_context(half_a_request(url, source="127.0.0.9"))
        many = [held.enter_context(half_a_request(url)) for _ in range(2 * MAX_STRANGERS)]
        wait_for(lambda: sum(map(alive, many)) < MAX_STRANGERS, "that only so many are left")
        assert alive(other)


@pytest.mark.slow
def test_a_stream_with_the_token_outlives_any_number_of_strangers(tmp_path: Path) -> None:
    with ExitStack() as held:
        url = held.enter_context(page(tmp_path))
        token = f"Authorization: Bearer {urlsplit(url).fragment}\r\n"
        operator = held.enter_context(open_request(url, "/events", token))
        operator.settimeout(PATIENCE_S)
        assert b" 200 " in operator.recv(4096)
        many = [held.enter_context(half_a_request(url)) for _ in range(2 * MAX_STRANGERS + MAX_TRUSTED)]
        wait_for(lambda: sum(map(alive, many)) <= MAX_STRANGERS, "that only so many are left")
        assert alive(operator)


@pytest.mark.slow
def test_browsers_without_the_token_leave_places_for_those_with_it(tmp_path: Path) -> None:
    with ExitStack() as held:
        url = held.enter_context(page(tmp_path))
        for _ in range(40):
            stranger = held.enter_context(open_request(url, "/events"))
            stranger.settimeout(PATIENCE_S)
            assert stranger.recv(4096)
        assert status(url, "GET", "/events") == 503
        assert status(url, "GET", "/events", Authorization=f"Bearer {urlsplit(url).fragment}") == 200


@pytest.mark.slow
def test_a_header_without_end_is_not_kept(tmp_path: Path) -> None:
    with page(tmp_path) as url, half_a_request(url) as endless:
        with suppress(ConnectionError):
            for _ in range(20):
                endless.sendall(b"x" * 1000)
        endless.settimeout(PATIENCE_S)
        with suppress(ConnectionError):
            assert b" 400 " in endless.recv(4096)


def test_headers_that_do_not_come_end_the_connection() -> None:
    async def waiting() -> bytes:
        connections = Connections(request_s=0.05)

        async def take(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connections.add(writer.get_extra_info("peername"), writer.transport)

        server = await asyncio.start_server(take, "127.0.0.1", 0)
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
        writer.write(b"GET / HTTP/1.1\r\n")
        try:
            return await asyncio.wait_for(reader.read(), PATIENCE_S)
        finally:
            writer.close()
            server.close()

    assert asyncio.run(waiting()) == b""


@pytest.mark.slow
def test_a_question_is_given_back_when_the_page_is_gone(tmp_path: Path) -> None:
    control = Control(may_answer=True)
    with serving(Feed(PageState(About("", ""))), control, tmp_path, PageAddress(port=0)):
        pass
    assert control.ask((), "start") is None


@pytest.mark.slow
def test_a_page_that_fails_says_so_and_what_it_showed_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class Broken(Feed):
        def news(self) -> bytes | None:
            raise ZeroDivisionError("a defect")

    with serving(Broken(PageState(About("", ""))), Control(may_answer=False), tmp_path, PageAddress(port=0)) as url:
        wait_for(lambda: "The page has ended" in capsys.readouterr().err, "what it says")
        with pytest.raises(OSError):
            socket.create_connection((urlsplit(url).hostname, urlsplit(url).port or 0), timeout=PATIENCE_S)
