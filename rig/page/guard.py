"""Who may speak to the server: a browser that knows it by its own name, from its own page, with the token to act.

A page of somewhere else can make a browser send requests here, and its name server can even make it believe that here
is its own (DNS rebinding). Neither can change the Host and Origin that the browser sends.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from secrets import compare_digest, token_urlsafe
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

TOKEN_BYTES = 16
COOKIE = "rig_page"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
CERTIFICATE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; frame-ancestors 'none'"
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
    """Under which `hosts` (name:port) the server is known, the `token`, and whether it is needed even to look on."""

    hosts: frozenset[str]
    token: str
    looking_needs_token: bool

    def may_act(self, headers: Mapping[str, str]) -> bool:
        """Whether a request carries the token. A cookie is not enough: browsers send it unasked."""
        scheme, _, given = headers.get("authorization", "").partition(" ")
        return scheme == "Bearer" and self._fits(given)

    def may_look(self, headers: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        """Whether it may read what is shown."""
        return not self.looking_needs_token or self.may_act(headers) or self._fits(cookies.get(COOKIE, ""))

    def refusal(self, headers: Mapping[bytes, bytes]) -> tuple[int, str] | None:
        """Status and reason for a request that comes from elsewhere, None for one that may go on."""
        if headers.get(b"host", b"").decode("latin-1").lower() not in self.hosts:
            return 400, "this server is not known by that name"
        origin = headers.get(b"origin")
        if origin is not None and origin.decode("latin-1").lower() not in {f"http://{host}" for host in self.hosts}:
            return 403, "this request comes from another page"
        return None

    def _fits(self, given: str) -> bool:
        return compare_digest(given.encode(), self.token.encode())


class Guard:
    """Around the application: refuses what comes from elsewhere, and tells browsers what they may do with it."""

    def __init__(self, app: "ASGIApp", door: Door) -> None:
        self._app, self._door = app, door
        headers = HEADERS if door.looking_needs_token else HEADERS | OPENER
        self._headers = [(name.encode(), value.encode()) for name, value in headers.items()]

    async def __call__(self, scope: "Scope", receive: "Receive", send: "Send") -> None:
        """As ASGI has it."""
        if scope["type"] != "http":
            return

        async def with_headers(message: "Message") -> None:
            if message["type"] == "http.response.start":
                there = {name for name, _ in message.get("headers", ())}
                more = [(name, value) for name, value in self._headers if name not in there]
                message = {**message, "headers": [*message.get("headers", ()), *more]}
            await send(message)

        refusal = self._door.refusal(dict(scope["headers"]))
        if refusal is None:
            await self._app(scope, receive, with_headers)
            return
        from starlette.responses import PlainTextResponse

        status, reason = refusal
        await PlainTextResponse(f"{reason}\n", status)(scope, receive, with_headers)
