"""The address of a key in a PKCS#11 token (RFC 7512): token, key and library, but never its PIN."""

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
    """The key labelled `name` in the `token` (None: the only one), read by the PKCS#11 module at `module_path`."""

    token: str | None
    name: str
    module_path: str

    @property
    def label(self) -> str:
        """The key's name in messages."""
        return f"{SCHEME}object={self.name}" if self.token is None else f"{SCHEME}token={self.token};object={self.name}"


def is_token_address(text: str) -> bool:
    """Return whether the text is meant as the address of a key in a token, or contains a PIN as only one can."""
    decoded = _decode(text)
    return decoded.strip().startswith(SCHEME) or _PIN.search(decoded) is not None


def token_key(address: str) -> TokenKey:
    """Return the key of an address. Raise Refused `signing_key` if it contains a PIN or is of another form.

    No message repeats the address, because any part of it may be a PIN.
    """
    if _PIN.search(_decode(address)):
        what = "the address of the token contains a PIN, which every user of this computer can read"
        raise Refused("signing_key", what, f"Leave it out, as {FORM}, and give the PIN in {PASSPHRASE}; then change it")
    scheme, rest = address[: len(SCHEME)], address[len(SCHEME) :]
    path, _, query = rest.partition("?")
    where, how = _attributes(path.split(";")), _attributes(query.split("&"))
    is_valid = scheme.casefold() == SCHEME and where.keys() <= {"token", "object"} and how.keys() <= {"module-path"}
    if not is_valid or not where.get("object") or not how.get("module-path"):
        what = f"the address of the token is not of the form {FORM}"
        raise Refused("signing_key", what, f"Write it so, each part once; the PIN of the token in {PASSPHRASE}")
    return TokenKey(where.get("token"), where["object"], how["module-path"])


def _decode(address: str) -> str:
    """Return the address in lower case, with percent encoding removed repeatedly."""
    while (unquoted := unquote(address)) != address:
        address = unquoted
    return normalize("NFKC", address).casefold()


def _attributes(parts: Sequence[str]) -> dict[str, str]:
    """Return the attributes by name. Duplicates have an empty name, which is refused."""
    pairs = [(unquote(name), unquote(value)) for name, _, value in (part.partition("=") for part in parts)]
    names = [name for name, _ in pairs]
    return {name if names.count(name) == 1 else "": value for name, value in pairs}
