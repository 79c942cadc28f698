"""Nothing is installed whose licence nobody has looked at."""

import re

import pytest

from support.dependencies import licence, list_needed

# Whose terms are kept by naming them: MIT, BSD, Apache and their like, as packages spell them.
PERMISSIVE = {
    "0BSD", "Apache", "Apache 2.0", "Apache Software License", "Apache-2.0", "BSD", "BSD License", "BSD-2-Clause",
    "BSD-3-Clause", "CC0-1.0", "DFSG approved", "ISC License (ISCL)", "LLVM-exception", "MIT", "MIT License", "MIT-0",
    "MIT-CMU", "PSF-2.0", "Public Domain", "Python Software Foundation License", "Zlib",
}  # fmt: skip
# What asks for more than that, or says less, and why it may stay.
LOOKED_AT = {
    "unicorn": "GPL-2.0 (its engine; only the bindings are BSD): extra world, in a process of its own",
    "certifi": "MPL-2.0, unchanged: certificates",
    "hypothesis": "MPL-2.0, unchanged: tests",
    "pathspec": "MPL-2.0, unchanged: tests",
    "saxonche": "MPL-2.0, unchanged: tests, states none in its metadata",
    "pyphen": "MPL-1.1, GPL-2.0+ or LGPL-2.1+: extra pdf, imported by WeasyPrint",
    "docutils": "public domain, BSD, GPL in single files: tests",
    "psycopg": "LGPL-3.0: extra postgres",
    "psycopg-binary": "LGPL-3.0: extra postgres",
    "allantools": "LGPL-3.0: tests",
    "dcclib": "LGPL-3.0: tests",
    "dcc-json-toolkit": "LGPL-2.1: tests",
    "pymavlink": "LGPL-3.0: extra autopilot",
    "apsw": "any that OSI approves: extra ros2",
}  # fmt: skip


@pytest.mark.slow
def test_every_dependency_has_a_licence_that_somebody_has_looked_at() -> None:
    packages = list_needed(["dev"])
    assert len(packages) > 50, "the program is not installed with its extras"
    unknown = []
    for name, package in sorted(packages.items()):
        said = licence(package)
        print(f"{name} {package.version}: {LOOKED_AT.get(name, said)}")
        parts = (
            re.split(r" AND | OR | WITH | / ", said.replace("(", "").replace(")", "")) if "ISCL" not in said else [said]
        )
        if name not in LOOKED_AT and not set(parts) <= PERMISSIVE:
            unknown.append(f"{name}: {said or 'states none'}")
    assert not unknown, "look at these licences, then enter them here:\n" + "\n".join(unknown)


def test_what_every_installation_brings_is_permissive() -> None:
    assert not list_needed([]).keys() & LOOKED_AT.keys()
