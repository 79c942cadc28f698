"""The page's addresses: files to show it, the stream of what is shown, the certificate, and two that act."""

import json
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.data.run_folder import CERTIFICATE
from rig.page.server.connections import Connections
from rig.page.server.control import Control
from rig.page.server.feed import Broadcast
from rig.page.server.guard import CERTIFICATE_POLICY, COOKIE, Door, Guard

STATIC = Path(__file__).parents[1] / "static"
MEDIA = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
LARGEST_BODY = 1000  # bytes
LARGEST_CERTIFICATE = 8_000_000
Handler = Callable[[Request], Awaitable[Response]]


def guarded(routes: Sequence[Route], door: Door, connections: Connections) -> Guard:
    """The addresses behind their door."""
    return Guard(Starlette(routes=routes), door, connections)


def looking(broadcast: Broadcast, door: Door, home: str) -> list[Route]:
    """The addresses that whoever looks on needs; `home` is the page that opens first."""

    async def stream(request: Request) -> Response:
        if not door.may_look(request.headers):
            return _refused()
        known = door.may_act(request.headers)
        if broadcast.full(known=known):
            return PlainTextResponse("too many browsers look on\n", 503)
        streaming = StreamingResponse(broadcast.frames(known=known), media_type="text/event-stream")
        if door.looking_needs_token:
            streaming.set_cookie(COOKIE, door.pass_to_look, path=f"/{CERTIFICATE}", httponly=True, samesite="strict")
        return streaming

    async def nothing(request: Request) -> Response:
        return Response(status_code=204)

    shown = {path.name: path for path in STATIC.rglob("*") if path.suffix in MEDIA}
    files = [Route("/", _file(shown[home])), Route("/favicon.ico", nothing)]
    files += [Route(f"/{name}", _file(path)) for name, path in shown.items()]
    return [*files, Route("/events", stream)]


def acting(door: Door, handler: Handler) -> Handler:
    """A handler for those alone who have the token."""

    async def allowed(request: Request) -> Response:
        return await handler(request) if door.may_act(request.headers) else _refused()

    return allowed


async def body_of(request: Request) -> bytes:
    """A request's body; nothing of one that is longer than any that is wanted."""
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > LARGEST_BODY:
            return b""
    return body


def of_a_run(broadcast: Broadcast, control: Control, door: Door, folder: Path) -> list[Route]:
    """The addresses of a run in `folder`: its certificate, and the two that act."""

    async def certificate(request: Request) -> Response:
        if not door.may_open(request.headers, request.cookies):
            return _refused()
        try:
            text = await run_in_threadpool(
                read_regular_file, folder / CERTIFICATE, LARGEST_CERTIFICATE, follow_links=False
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
        said = await _answer(request)
        if said is None:
            return PlainTextResponse('wanted: {"number": 1, "agreed": true}\n', 400)
        number, agreed = said
        if not control.answer(number, agreed=agreed):
            return PlainTextResponse("that is not asked, or not here\n", 409)
        return Response(status_code=202)

    return [
        Route(f"/{CERTIFICATE}", certificate),
        Route("/stop", acting(door, stop), methods=["POST"]),
        Route("/answer", acting(door, answer), methods=["POST"]),
    ]


def _file(path: Path) -> Handler:
    text, media = path.read_bytes(), MEDIA[path.suffix]

    async def served(request: Request) -> Response:
        return Response(text, media_type=media)

    return served


async def _answer(request: Request) -> tuple[int, bool] | None:
    """The question's number and the answer; None for anything else."""
    try:
        said = json.loads(await body_of(request))
    except ValueError:
        return None
    if not isinstance(said, dict) or type(said.get("number")) is not int or type(said.get("agreed")) is not bool:
        return None
    return said["number"], said["agreed"]


def _refused() -> Response:
    return PlainTextResponse("the address with the token is needed, as the terminal shows it\n", 403)
