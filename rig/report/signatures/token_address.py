"""The address of a key in a PKCS#11 token (RFC 7512): which token, which key, which library; and never its PIN."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from unicodedata import normalize
from urllib.parse import unquote

from rig.errors import Refused

PASSPHRASE = "RIG_SIGNING_PASSPHRASE"
SCHEME = "pkcs11:"
FORM = f"{SCHEME}token=NAME;object=NAME?module-path=LIBRARY"
_PIN = re.compile(r"pin[\W_]*(value|source)|(^|[\W_])pin[\W_]*=")


@dataclass(frozen=True, slots=True)
class TokenKey:
    """The key labelled `name` in the `token` (None: the only one), which the module at `module_path` reaches."""

    token: str | None
    name: str
    module_path: str

    @property
    def label(self) -> str:
        """Return its name for messages."""
        return f"{SCHEME}object={self.name}" if self.token is None else f"{SCHEME}token={self.token};object={self.name}"


def is_token_address(text: str) -> bool:
    """Return whether this is meant as an address of a key in a token, in whatever spelling, and not as a file."""
    return _decoded(text).strip().startswith(SCHEME)


def token_key(address: str) -> TokenKey:
    """Return the key that an address names. Raises Refused `signing_key` if it holds a PIN or is of another form.

    The address is repeated in no message: whatever it holds may be a PIN.
    """
    if _PIN.search(_decoded(address)):
        what = "the address of the token has a PIN in it, and who sees the processes of this computer reads it"
        raise Refused("signing_key", what, f"Leave it out, as {FORM}, and give the PIN in {PASSPHRASE}; then change it")
    scheme, rest = address[: len(SCHEME)], address[len(SCHEME) :]
    path, _, query = rest.partition("?")
    where, how = _attributes(path.split(";")), _attributes(query.split("&"))
    known = scheme.casefold() == SCHEME and where.keys() <= {"token", "object"} and how.keys() <= {"module-path"}
    if not known or not where.get("object") or not how.get("module-path"):
        what = f"the address of the token is not of the form {FORM}"
        raise Refused("signing_key", what, f"Write it so, each part once; the PIN of the token in {PASSPHRASE}")
    return TokenKey(where.get("token"), where["object"], how["module-path"])


def _decoded(address: str) -> str:
    """The address in small letters without variants, as often percent-decoded as it was encoded."""
    while (decoded := unquote(address)) != address:
        address = decoded
    return normalize("NFKC", address).casefold()


def _attributes(parts: Sequence[str]) -> dict[str, str]:
    """The attributes by name; one that stands twice under a name that nothing has."""
    pairs = [(unquote(name), unquote(value)) for name, _, value in (part.partition("=") for part in parts)]
    names = [name for name, _ in pairs]
    return {name if names.count(name) == 1 else "": value for name, value in pairs}
