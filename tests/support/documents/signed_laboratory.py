"""A laboratory that has signed the certificate of one run, and the output of `rig verify` on its files."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from rig.data.result_file import write_result
from rig.history.entered.finished_run import read_finished_run
from rig.history.store import open_history
from support.documents.certified import result
from support.documents.signing import PASSPHRASE, Holder, holder, stamping, time_server
from support.laboratories.commands import rig_here
from support.paths import CONFIGS

PDF, XML, RESULT, PAGE = "certificate.pdf", "certificate.xml", "result.json", "certificate.html"


@dataclass(frozen=True)
class Laboratory:
    """A run folder whose certificate was signed once, its history, and the certificates of its signer.

    `root`: the authority's certificate as PEM; `stranger`: a folder with the same certificate, signed by another person
    of the same name.
    """

    folder: Path
    history: Path
    root: Path
    stranger: Path
    authority: Holder
    signer: Holder

    def read(self, name: str) -> bytes:
        return (self.folder / name).read_bytes()

    def copied(self, to: Path) -> "Laboratory":
        """Return a copy in which files may be altered."""
        shutil.copytree(self.folder, to / "run")
        shutil.copy(self.history, to / "history.sqlite")
        return replace(self, folder=to / "run", history=to / "history.sqlite")

    def verified(
        self, *names: str, history: bool = True, trust: bool = True, signer: str | None = None
    ) -> tuple[int, str]:
        """Return the exit status and the output of `rig verify … --json`."""
        command = ["verify", *(str(self.folder / name) for name in names), "--json"]
        command += ["--history", str(self.history)] if history else []
        command += ["--trust", str(self.root)] if trust else []
        command += ["--signer", signer] if signer is not None else []
        ended = rig_here(*command)
        return ended.returncode, ended.stdout


def names_of(output: str) -> list[str]:
    return [problem["name"] for file in json.loads(output)["files"] for problem in file["problems"]]


@contextmanager
def make_signed_laboratory(base: Path) -> Iterator[Laboratory]:
    """Yield a laboratory in the folder `base`; meanwhile the passphrase of its keys is in the environment."""
    folder, history = base / "run", base / "history.sqlite"
    folder.mkdir()
    write_result(result(), folder)
    demo = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    (folder / "config.yaml").write_text(f"{demo}site: {{country: DE, laboratory: Ours}}\n", encoding="utf-8")
    with open_history(str(history)) as opened:
        opened.enter(read_finished_run(folder))
    authority = holder("Authority")
    signer = holder("Laboratory", authority)
    (base / "root.pem").write_bytes(authority.certificates())
    with pytest.MonkeyPatch.context() as patch, time_server(stamping("Time server", authority)) as url:
        patch.setenv("RIG_SIGNING_PASSPHRASE", PASSPHRASE)
        patch.setenv("RIG_HISTORY", str(history))
        stranger = holder("Laboratory", holder("Authority"))
        command = ["report", str(folder), "--pdf", "--dcc", "--time-server", url, "--sign"]
        elsewhere = ["--out", str(base / "stranger"), "--history", "off"]
        for by, more in ((signer, list[str]()), (stranger, elsewhere)):
            ended = rig_here(*command, str(by.p12(base / "key.p12")), *more)
            assert ended.returncode == 0, ended.stderr
    yield Laboratory(folder, history, base / "root.pem", base / "stranger", authority, signer)
