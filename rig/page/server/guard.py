"""Who may speak to the server: a browser that knows it by its own name, from its own page, with the token to act.

A page of somewhere else can make a browser send requests here, and its name server can even make it believe that here
is its own (DNS rebinding). Neither can change the Host, Origin and Sec-Fetch-Site that the browser sends.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from secrets import compare_digest, token_urlsafe
from typing import TYPE_CHECKING

from rig.page.server.connections import Connections, client_of

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

TOKEN_BYTES = 16
COOKIE = "rig_page"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# A certificate may be of a folder that somebody sent: it runs nothing, sends nothing, and leads nowhere by itself.
CERTIFICATE_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
OWN_SITE = (b"same-origin", b"none")  # its own page, or an address that somebody typed
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
OPENER = {"cross-origin-opener-policy": "same-origin"}  # heeded from loopback, complained of from elsewhere without TLS


def new_token() -> str:
    """128 bits, as they fit into an address."""
    return token_urlsafe(TOKEN_BYTES)


@dataclass(frozen=True, slots=True)
class Door:
    """The page's door: under which `hosts` (name:port) it is known, the `token`, whether it is needed even to look on.

    `pass_to_look` opens the certificate and nothing else: it is for a cookie, and cookies know no port.
    """

    hosts: frozenset[str]
    token: str
    looking_needs_token: bool
    pass_to_look: str = field(default_factory=new_token)

    def may_act(self, headers: Mapping[str, str]) -> bool:
        """Whether a request carries the token. A cookie is not enough: browsers send it unasked."""
        scheme, _, given = headers.get("authorization", "").partition(" ")
        return scheme == "Bearer" and _same(given, self.token)

    def may_look(self, headers: Mapping[str, str]) -> bool:
        """Whether it may read what is shown."""
        return not self.looking_needs_token or self.may_act(headers)

    def may_open(self, headers: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        """Whether it may read the certificate, which opens by a link that can carry no header."""
        return self.may_look(headers) or _same(cookies.get(COOKIE, ""), self.pass_to_look)

    def refusal(self, path: str, headers: Mapping[bytes, bytes]) -> tuple[int, str] | None:
        """Status and reason for a request that comes from elsewhere, None for one that may go on."""
        if headers.get(b"host", b"").decode("latin-1").lower() not in self.hosts:
            return 400, "this server is not known by that name"
        origin = headers.get(b"origin")
        if origin is not None and origin.decode("latin-1").lower() not in {f"http://{host}" for host in self.hosts}:
            return 403, "this request comes from another page"
        followed = path == "/" and headers.get(b"sec-fetch-dest") == b"document"  # a link to the page, which is empty
        if headers.get(b"sec-fetch-site", b"none") not in OWN_SITE and not followed:
            return 403, "this request comes from another page"
        return None


def _same(given: str, wanted: str) -> bool:
    return compare_digest(given.encode(), wanted.encode())


class Guard:
    """A guard around the application: refuses what comes from elsewhere, tells browsers what they may do with it."""

    def __init__(self, app: "ASGIApp", door: Door, connections: Connections) -> None:
        self._app, self._door, self._connections = app, door, connections
        headers = HEADERS if door.looking_needs_token else HEADERS | OPENER
        self._headers = [(name.encode(), value.encode()) for name, value in headers.items()]

    async def __call__(self, scope: "Scope", receive: "Receive", send: "Send") -> None:
        """Answer a request, as ASGI has it, with the headers that guard the page."""
        if scope["type"] != "http":
            return

        async def with_headers(message: "Message") -> None:
            if message["type"] == "http.response.start":
                there = {name for name, _ in message.get("headers", ())}
                more = [(name, value) for name, value in self._headers if name not in there]
                message = {**message, "headers": [*message.get("headers", ()), *more]}
            await send(message)

        from starlette.datastructures import Headers
        from starlette.responses import PlainTextResponse

        refusal = self._door.refusal(scope["path"], dict(scope["headers"]))
        app = self._app if refusal is None else PlainTextResponse(f"{refusal[1]}\n", refusal[0])
        known = refusal is None and self._door.may_act(Headers(scope=scope))
        with self._connections.answering(client_of(scope.get("client")), known=known):
            await app(scope, receive, with_headers)
