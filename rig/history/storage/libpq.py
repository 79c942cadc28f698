"""What PostgreSQL's client is told beside the address: to whom it may say a password, and how long it waits. Pure.

The client takes passwords from `~/.pgpass` and PGPASSWORD by itself. So none is said to anybody: SCRAM proves that both
sides know it, and a server that asks for it in clear text or as an MD5 hash is left. Source: PostgreSQL 16's
documentation, 34.1.2, `require_auth`, `sslmode`, `tcp_user_timeout`.
"""

import os
from collections.abc import Mapping
from ipaddress import ip_address
from typing import TYPE_CHECKING

from rig.config.judging.history_address import ENCRYPTED

if TYPE_CHECKING:
    from sqlalchemy import URL

CONNECT_S = 5
SILENCE_S = 5  # until a line that takes nothing more is given up


def connect_arguments(server: "URL", environment: Mapping[str, str] = os.environ) -> dict[str, str | int]:
    """Options of the connection. To another computer it is encrypted and proved with a password, always.

    On this computer nobody listens on the way, and the system may know the user without a password. A user may ask for
    more encryption by PGSSLMODE, and for another proof, such as `gss`, by PGREQUIREAUTH.
    """
    at_hand = _on_this_computer(server, environment)
    told: dict[str, str | int] = {
        "require_auth": environment.get("PGREQUIREAUTH") or ("scram-sha-256,none" if at_hand else "scram-sha-256"),
        "connect_timeout": CONNECT_S,
        "tcp_user_timeout": SILENCE_S * 1000,
        "keepalives_idle": SILENCE_S,
    }
    if "sslmode" not in server.query:
        wished = environment.get("PGSSLMODE", "")
        told["sslmode"] = wished if wished in ENCRYPTED else "prefer" if at_hand else ENCRYPTED[0]
    return told


def _on_this_computer(server: "URL", environment: Mapping[str, str]) -> bool:
    if environment.get("PGHOSTADDR") or environment.get("PGSERVICE"):
        return False  # they say where it is, and nobody knows here
    queried = server.query.get("host", ())
    said = [server.host or "", *([queried] if isinstance(queried, str) else queried)]
    hosts = [host for each in said for host in each.split(",") if host] or [environment.get("PGHOST", "")]
    return all(map(_is_at_hand, hosts))


def _is_at_hand(host: str) -> bool:
    """A socket's folder, or this computer's own address."""
    if host in ("", "localhost") or host[0] in "/@":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        # Of several hosts in a query each may have a port.
        name, _, port = host.rpartition(":")
        return port.isdecimal() and _is_at_hand(name)
