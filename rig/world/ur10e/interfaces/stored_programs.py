"""The programs on the simulated controller's disk: one that waits for ever, and those that a client uploads."""

import json

WAIT_PROGRAM = "wait_program"
DEFAULT_PROGRAM = "Default program"  # the program that a PolyScope X has loaded at the start
MAX_PROGRAMS = 50


class WaitProgram:
    """A program that waits for ever."""

    waiting = True

    def __init__(self, name: str) -> None:
        self.name = name

    def step(self) -> bool:
        return True


class StoredPrograms:
    """The programs of a PolyScope X by name, each as the JSON document that its pendant exports."""

    def __init__(self) -> None:
        self._documents: dict[str, str] = dict.fromkeys((DEFAULT_PROGRAM, WAIT_PROGRAM), "{}")

    def __contains__(self, name: str) -> bool:
        return name in self._documents

    def read(self, name: str) -> str:
        """Return a program's document. Raise KeyError for an unknown name."""
        return self._documents[name]

    def store(self, form: bytes, *, replace: bool) -> str:
        """Store the document in the `form` that a client sends, and return its name.

        If `replace`, the document must replace one of the same name; otherwise its name must be new. Raise ValueError
        for a wrong name, or if the form contains no document that can be stored.
        """
        text = form[form.find(b"{") : form.rfind(b"}") + 1].decode()
        try:
            name = json.loads(text)["program"]["programInformation"]["name"]
        except (TypeError, KeyError, RecursionError):
            raise ValueError("no program") from None
        if not isinstance(name, str) or len(self._documents) >= MAX_PROGRAMS:
            raise ValueError("no program that can be stored")
        if (name in self._documents) is not replace:
            raise ValueError("no such program" if replace else "the program exists")
        self._documents[name] = text
        return name

    def describe(self) -> list[dict[str, object]]:
        """Return the Robot API's list of programs."""
        blank = {"createdDate": 0, "description": "", "lastModifiedDate": None, "lastSavedDate": None}
        return [{**blank, "name": name, "programState": "FINAL"} for name in self._documents]
