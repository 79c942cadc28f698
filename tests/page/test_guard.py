"""Who may speak to the page's server, asked over a real socket."""

import argparse
import http.client
import json
import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from rig.commands.page_arguments import PageWish, add_page, read_page_wish
from rig.commands.station.watch import read_last_words
from rig.errors import Refused
from rig.page.about import About
from rig.page.page_state import PageState
from rig.page.server.control import STOP_REASON, Control
from rig.page.server.feed import Feed
from rig.page.server.guard import Door
from rig.page.server.serving import PageAddress, serving
from rig.station.events import Prompt
from support.processes.waiting import PATIENCE_S, wait_for

TOKEN = "a-token-of-two-and-twenty"


class Asking:
    """Requests to one server, with the token unless told otherwise."""

    def __init__(self, url: str) -> None:
        self.port = urlsplit(url).port or 0
        self.token = urlsplit(url).fragment

    def __call__(
        self, method: str, path: str, body: str | None = None, **headers: str
    ) -> tuple[int, str, dict[str, str]]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        sent = {
            "Authorization": f"Bearer {self.token}",
            **{name.replace("_", "-"): text for name, text in headers.items()},
        }
        connection.request(method, path, body, {name: text for name, text in sent.items() if text})
        answer = connection.getresponse()
        told = {name.lower(): text for name, text in answer.getheaders()}
        text = "" if path == "/events" and answer.status == 200 else answer.read().decode()
        connection.close()
        return answer.status, text, told


@contextmanager
def server(folder: Path, control: Control | None = None, feed: Feed | None = None) -> Iterator[Asking]:
    feed = feed or Feed(PageState(About("a run", "six_observation", may_answer=True)))
    with serving(feed, control or Control(may_answer=True), folder, PageAddress(port=0, token=TOKEN)) as url:
        yield Asking(url)


@pytest.fixture(scope="module")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Asking]:
    folder = tmp_path_factory.mktemp("run")
    (folder / "certificate.html").write_text("<p>signed</p>", encoding="utf-8")
    with server(folder) as asking:
        yield asking


@pytest.mark.parametrize("path", ["/", "/events", "/certificate.html", "/page.js", "/nowhere"])
@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example:{port}"])
def test_a_foreign_name_is_refused(ask: Asking, path: str, host: str) -> None:
    assert ask("GET", path, Host=host.format(port=ask.port))[0] == 400


@pytest.mark.parametrize("path", ["/stop", "/answer", "/events"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}"])
def test_a_request_of_another_page_is_refused(ask: Asking, path: str, origin: str) -> None:
    method = "GET" if path == "/events" else "POST"
    assert ask(method, path, Origin=origin.format(port=ask.port))[0] == 403


@pytest.mark.parametrize("path", ["/stop", "/answer"])
def test_what_acts_wants_the_token_and_a_post(ask: Asking, path: str) -> None:
    assert ask("GET", path)[0] == 405
    for wrong in ("", "Bearer wrong", f"Basic {ask.token}", f"Bearer {ask.token}x"):
        assert ask("POST", path, Authorization=wrong)[0] == 403
    assert ask("POST", path, Authorization="", Cookie=f"rig_page={ask.token}")[0] == 403
    own = f"http://127.0.0.1:{ask.port}"
    assert ask("POST", path, '{"number": 1, "agreed": true}', Origin=own)[0] == 409  # nothing runs, nothing is asked


@pytest.mark.parametrize(
    "body", ["", "[]", "{", '{"number": "1", "agreed": true}', '{"number": true, "agreed": 1}', "x" * 2000]
)
def test_an_answer_of_another_form_is_refused(ask: Asking, body: str) -> None:
    assert ask("POST", "/answer", body)[0] == 400


def test_everything_comes_with_a_policy_and_loads_nothing_from_elsewhere(ask: Asking) -> None:
    for path in ("/", "/page.js", "/page.css", "/favicon.ico", "/events"):
        status, text, headers = ask("GET", path)
        assert status in (200, 204) and "http://" not in text and "https://" not in text
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"] and headers["cache-control"] == "no-store"
        assert headers["x-content-type-options"] == "nosniff" and "access-control-allow-origin" not in headers
    status, text, headers = ask("GET", "/certificate.html")
    assert status == 200 and text == "<p>signed</p>" and "script" not in headers["content-security-policy"]
    assert headers["content-security-policy"].startswith("sandbox; ")
    assert ask("GET", "/../serving.py")[0] == ask("GET", "/config.yaml")[0] == 404


def test_others_than_this_computer_need_the_token_to_look(tmp_path: Path) -> None:
    door = Door(frozenset({"192.0.2.1:8137"}), TOKEN, looking_needs_token=True)
    assert not door.may_look({}) and door.may_look({"authorization": f"Bearer {TOKEN}"})
    assert not door.may_open({}, {}) and door.may_open({"authorization": f"Bearer {TOKEN}"}, {})


def test_a_cookie_opens_the_certificate_and_is_not_the_token() -> None:
    door = Door(frozenset({"192.0.2.1:8137"}), TOKEN, looking_needs_token=True)
    assert door.may_open({}, {"rig_page": door.pass_to_look}) and not door.may_open({}, {"rig_page": TOKEN})
    assert not door.may_act({"authorization": f"Bearer {door.pass_to_look}", "cookie": f"rig_page={TOKEN}"})


def test_no_cookie_is_set_where_every_port_of_this_computer_would_get_it(ask: Asking) -> None:
    assert all("set-cookie" not in ask("GET", path)[2] for path in ("/", "/events", "/certificate.html"))


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
@pytest.mark.parametrize("path", ["/events", "/certificate.html", "/page.js", "/"])
def test_what_another_page_loads_from_here_is_refused(ask: Asking, path: str, site: str) -> None:
    assert ask("GET", path, Sec_Fetch_Site=site, Sec_Fetch_Dest="image")[0] == 403
    assert ask("POST", "/stop", Sec_Fetch_Site=site)[0] == 403
    assert ask("GET", path, Sec_Fetch_Site="same-origin")[0] == ask("GET", path, Sec_Fetch_Site="none")[0] == 200


def test_a_link_elsewhere_leads_to_the_page_and_to_nothing_that_it_shows(ask: Asking) -> None:
    followed = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}
    assert ask("GET", "/", **followed)[0] == 200
    assert ask("GET", "/events", **followed)[0] == ask("GET", "/certificate.html", **followed)[0] == 403


def a_link(folder: Path) -> None:
    (folder / "private").write_text("a private file", encoding="utf-8")
    (folder / "certificate.html").symlink_to(folder / "private")


def a_pipe(folder: Path) -> None:
    os.mkfifo(folder / "certificate.html")


def a_sea(folder: Path) -> None:
    with (folder / "certificate.html").open("wb") as file:
        file.truncate(1 << 30)


@pytest.mark.slow
@pytest.mark.parametrize("planted", [a_link, a_pipe, a_sea])
def test_what_is_planted_as_a_certificate_is_not_shown(tmp_path: Path, planted: Callable[[Path], None]) -> None:
    planted(tmp_path)
    with server(tmp_path) as asking:
        status, text, _ = asking("GET", "/certificate.html")
    assert status == 404 and text.startswith("the certificate is not shown")


def test_a_port_that_is_taken_is_refused_by_name(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = PageAddress(port=taken.getsockname()[1])
        with (
            pytest.raises(Refused, match=r"page_address: .*in use"),
            serving(Feed(PageState(About("", ""))), Control(may_answer=False), tmp_path, address),
        ):
            pass


@pytest.mark.parametrize(
    ("address", "words"),
    [
        (PageAddress(host="192.0.2.1"), "needs a token"),
        (PageAddress(host="0.0.0.0", token=TOKEN), "every address"),
        (PageAddress(token="short"), "fewer than 22"),
        (PageAddress(host="192.0.2.1", port=1, token=TOKEN), "cannot be served at 192.0.2.1:1"),
    ],
)
def test_an_address_that_will_not_do_is_refused(tmp_path: Path, address: PageAddress, words: str) -> None:
    feed = Feed(PageState(About("", "")))
    with (
        pytest.raises(Refused, match="page_address: .*" + words),
        serving(feed, Control(may_answer=False), tmp_path, address),
    ):
        pass


@pytest.mark.slow
def test_a_page_that_may_not_answer_does_not(tmp_path: Path) -> None:
    control = Control(may_answer=False)
    threading.Thread(target=control.ask, args=((), "start"), daemon=True).start()
    with server(tmp_path, control) as asking:
        assert asking("POST", "/answer", '{"number": 1, "agreed": true}')[0] == 409


@pytest.mark.slow
def test_an_answer_counts_once_and_for_the_question_that_is_asked(tmp_path: Path) -> None:
    control = Control(may_answer=True)
    answers: list[bool | None] = []
    feed = Feed(PageState(About("", "")))
    asked = threading.Thread(target=lambda: answers.append(control.ask((), "start")))
    with server(tmp_path, control, feed) as asking:
        feed.event(Prompt(("The arm will move.",), "start"))
        asked.start()
        wrong = asking("POST", "/answer", json.dumps({"number": 2, "agreed": True}))[0]
        answers_right = [409]

        def answered() -> bool:
            answers_right.append(asking("POST", "/answer", json.dumps({"number": 1, "agreed": True}))[0])
            return answers_right[-1] != 409

        wait_for(answered, "that the question is there")
        asked.join(PATIENCE_S)
        again = asking("POST", "/answer", json.dumps({"number": 1, "agreed": True}))[0]
    assert (wrong, answers_right[-1], again, answers) == (409, 202, 409, [True])


@pytest.mark.slow
def test_a_stop_interrupts_the_run_and_nothing_after_it(tmp_path: Path) -> None:
    control = Control(may_answer=False)
    with server(tmp_path, control) as asking:
        with pytest.raises(KeyboardInterrupt, match=STOP_REASON), control.stoppable():
            threading.Thread(target=asking, args=("POST", "/stop")).start()
            threading.Event().wait(PATIENCE_S)
        assert asking("POST", "/stop")[0] == 409


@pytest.mark.parametrize(
    ("place", "host", "port"),
    [
        (None, "127.0.0.1", None),
        ("192.0.2.1", "192.0.2.1", None),
        ("192.0.2.1:80", "192.0.2.1", 80),
        ("[::1]:8000", "::1", 8000),
        ("::1", "::1", None),
    ],
)
def test_where_the_page_is_wanted(place: str | None, host: str, port: int | None) -> None:
    assert PageWish(place).address() == PageAddress(host, port)


@pytest.mark.parametrize("place", ["127.0.0.1:x", "127.0.0.1:99999", "127.0.0.1:-1"])
def test_a_port_that_is_none_is_refused(place: str) -> None:
    with pytest.raises(Refused, match="page_address"):
        PageWish(place).address()


def said(*words: str) -> PageWish | None:
    parser = argparse.ArgumentParser()
    add_page(parser)
    return read_page_wish(parser.parse_args(["--page", *words]))


def test_a_token_comes_from_a_file_or_the_environment_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_PAGE_TOKEN", TOKEN)
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}-of-a-file\n", encoding="utf-8")
    file.chmod(0o600)
    given = [said(), said("--page-token-file", str(file)), said("--page-token", f"{TOKEN}-said")]
    assert [each and each.token for each in given] == [TOKEN, f"{TOKEN}-of-a-file", f"{TOKEN}-said"]


@pytest.mark.parametrize("mode", [0o644, 0o640, None])
def test_a_tokens_file_that_others_read_or_that_is_missing_is_refused(tmp_path: Path, mode: int | None) -> None:
    file = tmp_path / "token"
    if mode is not None:
        file.write_text(TOKEN, encoding="utf-8")
        file.chmod(mode)
    with pytest.raises(Refused, match="page_address: the page's token cannot be read") as refused:
        said("--page-token-file", str(file))
    assert TOKEN not in str(refused.value)


def no_text(log: Path) -> None:
    log.write_bytes(b"2026-11-23 12:00:00,000 INFO stopped \xff\n")


def a_pipe_instead(log: Path) -> None:
    os.mkfifo(log)


def a_link_instead(log: Path) -> None:
    (log.parent / "private").write_text("now INFO a private matter\n", encoding="utf-8")
    log.symlink_to(log.parent / "private")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planted", "words"), [(no_text, "; stopped \ufffd"), (a_pipe_instead, ""), (a_link_instead, "")]
)
def test_a_log_of_a_foreign_folder_is_read_as_far_as_it_is_one(
    tmp_path: Path, planted: Callable[[Path], None], words: str
) -> None:
    planted(tmp_path / "log.txt")
    assert read_last_words(tmp_path) == "this run has no result" + words
