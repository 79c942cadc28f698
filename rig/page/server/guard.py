"""Access control of the server: requests need its proper name, its own page as origin, and the token to act.

A foreign page can make a browser send requests here, even under its own name if its name server gives this address (DNS
rebinding). The page cannot change the Host, Origin and Sec-Fetch-Site that the browser sends.
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
# A certificate may be from a foreign folder: it may run no script, send nothing, and open nothing by itself.
CERTIFICATE_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
OWN_SITE = (b"same-origin", b"none")  # its own page, or a typed address
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
OPENER = {"cross-origin-opener-policy": "same-origin"}  # loopback addresses only: for others without TLS browsers warn


def new_token() -> str:
    """Return 128 random bits as text that may be part of a URL."""
    return token_urlsafe(TOKEN_BYTES)


@dataclass(frozen=True, slots=True)
class Door:
    """Access to the page: its `hosts` (name:port), the `token`, and whether spectators need it too.

    `pass_to_look` is sent as a cookie and opens the certificate only, because cookies are not bound to a port: another
    server on this computer may receive them.
    """

    hosts: frozenset[str]
    token: str
    looking_needs_token: bool
    pass_to_look: str = field(default_factory=new_token)

    def may_act(self, headers: Mapping[str, str]) -> bool:
        """Return whether a request has the token. A cookie is not accepted, because browsers send it unasked."""
        scheme, _, token = headers.get("authorization", "").partition(" ")
        return scheme == "Bearer" and _are_equal(token, self.token)

    def may_look(self, headers: Mapping[str, str]) -> bool:
        """Return whether a request may read the page."""
        return not self.looking_needs_token or self.may_act(headers)

    def may_open(self, headers: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        """Return whether a request may read the certificate, which the browser opens with a cookie, not the token."""
        return self.may_look(headers) or _are_equal(cookies.get(COOKIE, ""), self.pass_to_look)

    def refusal(self, path: str, headers: Mapping[bytes, bytes]) -> tuple[int, str] | None:
        """Return status and reason for a request that is refused; None for a permitted one."""
        if headers.get(b"host", b"").decode("latin-1").lower() not in self.hosts:
            return 400, "this server does not have that name"
        origin = headers.get(b"origin")
        if origin is not None and origin.decode("latin-1").lower() not in {f"http://{host}" for host in self.hosts}:
            return 403, "this request comes from another page"
        # A link to the page, which itself contains no data.
        followed = path == "/" and headers.get(b"sec-fetch-dest") == b"document"
        if headers.get(b"sec-fetch-site", b"none") not in OWN_SITE and not followed:
            return 403, "this request comes from another page"
        return None


def _are_equal(one: str, other: str) -> bool:
    return compare_digest(one.encode(), other.encode())


class Guard:
    """A filter around the application, which refuses foreign requests and sets security headers."""

    def __init__(self, app: "ASGIApp", door: Door, connections: Connections) -> None:
        self._app, self._door, self._connections = app, door, connections
        headers = HEADERS if door.looking_needs_token else HEADERS | OPENER
        self._headers = [(name.encode(), value.encode()) for name, value in headers.items()]

    async def __call__(self, scope: "Scope", receive: "Receive", send: "Send") -> None:
        """Answer an ASGI request with the security headers."""
        if scope["type"] != "http":
            return

        async def send_with_headers(message: "Message") -> None:
            if message["type"] == "http.response.start":
                present = {name for name, _ in message.get("headers", ())}
                more = [(name, value) for name, value in self._headers if name not in present]
                message = {**message, "headers": [*message.get("headers", ()), *more]}
            await send(message)

        from starlette.datastructures import Headers
        from starlette.responses import PlainTextResponse

        refusal = self._door.refusal(scope["path"], dict(scope["headers"]))
        app = self._app if refusal is None else PlainTextResponse(f"{refusal[1]}\n", refusal[0])
        has_token = refusal is None and self._door.may_act(Headers(scope=scope))
        with self._connections.answering(client_of(scope.get("client")), has_token=has_token):
            await app(scope, receive, send_with_headers)
