"""Which Pythons have wheels for the extra `all` on Linux: `python -m tests.wheels` prints a line for each.

It keeps no file. Its status is 1 where a package would have to be built. The project's conditions, such as
`python_version < '3.14'`, are taken for the other Python. Those of other packages are taken for the Python
that runs this, because pip cannot be asked for another.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile

from tests.locks import PROJECT, requirements

PYTHONS = tuple(
    line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", line)
)
# glibc 2.28 is that of RHEL 8 and Debian 10.
PLATFORMS = [f"--platform=manylinux_2_{minor}_x86_64" for minor in range(28, 4, -1)]


def found(python: str) -> tuple[bool, str]:
    """Return whether `all` can be installed from wheels, and what it leaves out or what has none."""
    asked = {requirement.name: requirement for requirement in requirements(python, ["all"])}
    words = [f"{name}[{','.join(sorted(r.extras))}]{r.specifier}" for name, r in asked.items()]
    where = ["--only-binary=:all:", f"--python-version={python}", *PLATFORMS]
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "install", "-qq", "--dry-run", "--target", folder, *where]
        done = subprocess.run([*command, *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return False, " ".join(re.findall("^ERROR: (.*)", done.stderr, re.M))
    everywhere = {requirement.name for one in PYTHONS for requirement in requirements(one, ["all"])}
    left_out = sorted(everywhere - asked.keys())
    return True, f"all, without {', '.join(left_out)}" if left_out else "all"


if __name__ == "__main__":
    rows = {python: found(python) for python in PYTHONS}
    print(*(f"Python {python}: {words}" for python, (_, words) in rows.items()), sep="\n")
    sys.exit(not all(works for works, _ in rows.values()))
