"""Connection options of PostgreSQL's client: encryption, authentication, timeouts. Pure.

The client itself takes passwords from `~/.pgpass` and PGPASSWORD. SCRAM proves that both sides have a password without
disclosing it. A server that asks for the password in clear text or as an MD5 hash is refused. Source: PostgreSQL 16's
documentation, 34.1.2, `require_auth`, `sslmode`, `tcp_user_timeout`.
"""

import os
from collections.abc import Mapping
from ipaddress import ip_address
from typing import TYPE_CHECKING

from rig.config.judging.history_address import ENCRYPTED_MODES

if TYPE_CHECKING:
    from sqlalchemy import URL

CONNECT_TIMEOUT_S = 5
SILENCE_TIMEOUT_S = 5  # after which an unresponsive connection is closed


def connect_arguments(server: "URL", environment: Mapping[str, str] = os.environ) -> dict[str, str | int]:
    """Return the options of a connection. To another computer, it is always encrypted and authenticated.

    A connection within this computer needs neither: no network carries it, and the system may authenticate the user
    without a password. A user may require more encryption by PGSSLMODE, and another method of authentication, such as
    `gss`, by PGREQUIREAUTH.
    """
    is_local = _is_on_this_computer(server, environment)
    options: dict[str, str | int] = {
        "require_auth": environment.get("PGREQUIREAUTH") or ("scram-sha-256,none" if is_local else "scram-sha-256"),
        "connect_timeout": CONNECT_TIMEOUT_S,
        "tcp_user_timeout": SILENCE_TIMEOUT_S * 1000,
        "keepalives_idle": SILENCE_TIMEOUT_S,
    }
    if "sslmode" not in server.query:
        requested = environment.get("PGSSLMODE", "")
        options["sslmode"] = requested if requested in ENCRYPTED_MODES else "prefer" if is_local else ENCRYPTED_MODES[0]
    return options


def _is_on_this_computer(server: "URL", environment: Mapping[str, str]) -> bool:
    if environment.get("PGHOSTADDR") or environment.get("PGSERVICE"):
        return False  # these name a server that is unknown here
    queried = server.query.get("host", ())
    names = [server.host or "", *([queried] if isinstance(queried, str) else queried)]
    hosts = [host for name in names for host in name.split(",") if host] or [environment.get("PGHOST", "")]
    return all(map(_is_at_hand, hosts))


def _is_at_hand(host: str) -> bool:
    """Return whether the host is this computer: a local address, or a socket's folder."""
    if host in ("", "localhost") or host[0] in "/@":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        # If there are several hosts in a query, each may have a port.
        name, _, port = host.rpartition(":")
        return port.isdecimal() and _is_at_hand(name)
