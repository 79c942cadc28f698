"""What the wheel has beside its packages: the configurations and examples of the checkout, in `rig/supplied`."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

SUPPLIED = ("configs", "examples", "docs/examples", "docs/config.schema.json")


class BuildWithSupplies(build_py):
    """The usual build of packages, and a copy of the supplied files; an editable installation finds them in place."""

    def run(self) -> None:
        """Build the packages, then copy the files."""
        super().run()
        if self.editable_mode:
            return
        for name in SUPPLIED:
            source, target = Path(name), Path(self.build_lib, "rig", "supplied", name)
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
            else:
                shutil.copy(source, target)


setup(cmdclass={"build_py": BuildWithSupplies})
