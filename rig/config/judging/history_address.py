"""The addresses that a history may have: a file, or a database whose URL contains no secret."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sqlalchemy import URL

SCHEMES = ("postgresql", "sqlite")
# The parameters that a URL may have in addition to user, host and name. All other parameters of libpq (passwords, keys,
# services, session options) belong in the files and variables of the user, because recordings store the URL.
URL_PARAMETERS = {"postgresql": ("host", "port", "sslmode", "sslrootcert"), "sqlite": ()}
ENCRYPTED_MODES = ("require", "verify-ca", "verify-full")


def history_url(text: str) -> "URL":
    """Return the URL in a text, with percent encoding resolved. Raise ValueError if a part of it is not allowed."""
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(text)
    except (ArgumentError, ValueError) as error:
        raise ValueError("is not a URL") from error
    if url.drivername not in SCHEMES:
        raise ValueError(f"must be a file or begin with {' or '.join(f'{scheme}://' for scheme in SCHEMES)}")
    allowed = URL_PARAMETERS[url.drivername]
    for key in url.query:
        if key not in allowed:
            may = f"; it may state {', '.join(allowed)}" if allowed else ""
            raise ValueError(f"states {key!r} after its question mark, which a URL of a history cannot have{may}")
    if url.query.get("sslmode", ENCRYPTED_MODES[0]) not in ENCRYPTED_MODES:
        raise ValueError(f"has an sslmode other than {', '.join(ENCRYPTED_MODES)}")
    if url.drivername == "sqlite" and (not url.database or url.host or url.username):
        raise ValueError("names no file; write sqlite:////folder/history.sqlite")
    return url
