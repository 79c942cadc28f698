"""Forgeries of a result.json that is attached to a signed certificate, or entered in a history."""

import json
import re
from collections.abc import Callable
from typing import Any

Forgery = Callable[[bytes], bytes]


def replace(old: str, new: str) -> Forgery:
    def forge(content: bytes) -> bytes:
        forged = re.sub(old.encode(), new.encode(), content, count=1)
        assert forged != content, old
        return forged

    return forge


def document(change: Callable[[dict[str, Any]], object]) -> Forgery:
    def forge(content: bytes) -> bytes:
        entries = json.loads(content)
        change(entries)
        return written(entries)

    return forge


def written(value: Any, **form: Any) -> bytes:
    usual: dict[str, Any] = {"indent": 2, "ensure_ascii": False}
    return (json.dumps(value, **{**usual, **form}) + "\n").encode()


def reorder(entries: dict[str, Any]) -> None:
    entries["provenance"] = entries.pop("provenance")


def change_provenance(key: str, value: str) -> Forgery:
    return document(lambda entries: entries["provenance"].update({key: value}))


FORGED_JSON: dict[str, Forgery] = {
    "the verdict": replace(r'"verdict": "pass"', '"verdict": "fail"'),
    "the serial number": replace(r'"serial_number": "', r'"serial_number": "X'),
    "a scale factor": replace(r'("scale": \[\s*)\d', r"\g<1>7"),
    "a check": replace(r'"passed": true', '"passed": false'),
    "when it was solved": change_provenance("solved_utc", "2020-01-01T00:00:00Z"),
    "when it was measured": change_provenance("started_utc", "2020-01-01T00:00:00Z"),
    "a key more": document(lambda found: found.update(note="k = 1 1 1")),
    "a key of its parts more": change_provenance("accredited_by", "PTB"),
    "the order of its keys": document(reorder),
    "a key twice, the forged one first": replace(r'"verdict": "pass"', r'"verdict": "fail", "verdict": "pass"'),
    "a key twice, the forged one last": replace(r'"verdict": "pass"', r'"verdict": "pass", "verdict": "fail"'),
    "a key twice, in its parts": replace(r'"provenance": {', r'"provenance": {"started_utc": "2020-01-01T00:00:00Z",'),
    "a part twice": replace(r'"provenance": {', r'"provenance": {}, "provenance": {'),
    "the same key in another spelling": replace(r'"verdict": "pass"', r'"verdi\\u0063t": "fail", "verdict": "pass"'),
    "another document behind": lambda content: content + b'{"verdict": "pass"}\n',
    "a text behind": lambda content: content + b"// k = 1 1 1\n",
    "a comment": replace(r"{", r"{ /* k = 1 1 1 */"),
    "a zero byte behind": lambda content: content + b"\0",
    "a mark of the byte order": lambda content: b"\xef\xbb\xbf" + content,
    "UTF-16": lambda content: content.decode().encode("utf-16"),
    "no number": replace(r'("scale": \[\s*)[\d.]+', r"\g<1>NaN"),
    "everything": lambda content: b"{}",
    "nothing": lambda content: b"",
}
# What says the same in other bytes: a history knows the values, a signature the bytes.
IN_OTHER_BYTES: dict[str, Forgery] = {
    "a line at its end": lambda content: content + b"\n",
    "no blanks": lambda content: written(json.loads(content), indent=None),
    "the ends of its lines": lambda content: content.replace(b"\n", b"\r\n"),
    "a letter as a code": replace(r'"pass"', r'"p\\u0061ss"'),
}
