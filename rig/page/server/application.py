"""The page's routes: its files, the event stream, the certificate, and two routes that control the run."""

import json
from collections.abc import Awaitable, Callable
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.data.run_folder import CERTIFICATE
from rig.page.server.control import Control
from rig.page.server.feed import Broadcast
from rig.page.server.guard import CERTIFICATE_POLICY, COOKIE, Door

STATIC = Path(__file__).parents[1] / "static"
MEDIA_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
MAX_BODY_BYTES = 1000  # of a request
MAX_CERTIFICATE_BYTES = 8_000_000
Handler = Callable[[Request], Awaitable[Response]]


def read_only_routes(broadcast: Broadcast, door: Door, home: str) -> list[Route]:
    """Return the read-only routes: page, static files, stream of events."""

    async def stream(request: Request) -> Response:
        if not door.may_look(request.headers):
            return _token_needed()
        has_token = door.may_act(request.headers)
        if broadcast.full(has_token=has_token):
            return PlainTextResponse("too many browsers are connected\n", 503)
        streaming = StreamingResponse(broadcast.frames(has_token=has_token), media_type="text/event-stream")
        if door.looking_needs_token:
            streaming.set_cookie(COOKIE, door.pass_to_look, path=f"/{CERTIFICATE}", httponly=True, samesite="strict")
        return streaming

    async def nothing(request: Request) -> Response:
        return Response(status_code=204)

    shown = {path.name: path for path in STATIC.rglob("*") if path.suffix in MEDIA_TYPES}
    files = [Route("/", _file(shown[home])), Route("/favicon.ico", nothing)]
    files += [Route(f"/{name}", _file(path)) for name, path in shown.items()]
    return [*files, Route("/events", stream)]


def require_token(door: Door, handler: Handler) -> Handler:
    """Return a handler that requires the token."""

    async def allowed(request: Request) -> Response:
        return await handler(request) if door.may_act(request.headers) else _token_needed()

    return allowed


async def body_of(request: Request) -> bytes:
    """Return a request's body; empty if it is longer than any valid one."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > MAX_BODY_BYTES:
            return b""
    return body


def run_routes(broadcast: Broadcast, control: Control, door: Door, folder: Path) -> list[Route]:
    """Return the routes of a run in `folder`: the certificate, and the two routes that control the run."""

    async def certificate(request: Request) -> Response:
        if not door.may_open(request.headers, request.cookies):
            return _token_needed()
        try:
            text = await run_in_threadpool(
                read_regular_file, folder / CERTIFICATE, MAX_CERTIFICATE_BYTES, follow_links=False
            )
        except FileNotFoundError:
            return PlainTextResponse("there is no certificate yet\n", 404)
        except (OSError, UnfitFile) as error:
            why = error if isinstance(error, UnfitFile) else "it cannot be read"
            return PlainTextResponse(f"the certificate is not shown: {why}\n", 404)
        return Response(text, headers={"content-security-policy": CERTIFICATE_POLICY}, media_type="text/html")

    async def stop(request: Request) -> Response:
        if broadcast.over or not control.stop():
            return PlainTextResponse("nothing to stop\n", 409)
        return Response(status_code=202)

    async def answer(request: Request) -> Response:
        parsed = await _answer(request)
        if parsed is None:
            return PlainTextResponse('expected: {"number": 1, "agreed": true}\n', 400)
        number, agreed = parsed
        if not control.answer(number, agreed=agreed):
            return PlainTextResponse("this question is not open, or not answered here\n", 409)
        return Response(status_code=202)

    return [
        Route(f"/{CERTIFICATE}", certificate),
        Route("/stop", require_token(door, stop), methods=["POST"]),
        Route("/answer", require_token(door, answer), methods=["POST"]),
    ]


def _file(path: Path) -> Handler:
    text, media = path.read_bytes(), MEDIA_TYPES[path.suffix]

    async def served(request: Request) -> Response:
        return Response(text, media_type=media)

    return served


async def _answer(request: Request) -> tuple[int, bool] | None:
    """Return a question's number and the operator's answer to it; None if the request's body is not of this form."""
    try:
        document = json.loads(await body_of(request))
    except ValueError:
        return None
    if (
        not isinstance(document, dict)
        or type(document.get("number")) is not int
        or type(document.get("agreed")) is not bool
    ):
        return None
    return document["number"], document["agreed"]


def _token_needed() -> Response:
    return PlainTextResponse("use the address with the token that the terminal shows\n", 403)
