"""Which Pythons have wheels for the extra `all` on Linux: `python -m tests.wheels` prints a line for each.

It downloads no wheel. Its status is 1 where a package would have to be built.
"""

from __future__ import annotations

import re
import sys

from tests.locks import PROJECT, uv

PYTHONS = tuple(
    line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", line)
)


def wanted() -> set[str]:
    """Return the packages that the extras of `all` name."""
    extras = PROJECT["optional-dependencies"]
    parts = re.findall(r"\w+", extras["all"][0].partition("[")[2])
    names = {re.split(r"[^\w.-]", words)[0] for part in parts for words in extras[part]}
    return names - {PROJECT["name"]}


def found(python: str) -> tuple[bool, str]:
    """Return whether `all` can be installed from wheels, and what it leaves out or what has none."""
    done = uv("--extra", "all", "--python-version", python)
    if done.returncode != 0:
        return False, " ".join(done.stderr.split())
    there = {line.partition("==")[0] for line in done.stdout.splitlines()}
    left_out = sorted(name for name in wanted() if name.replace(".", "-") not in there)
    return True, f"without {', '.join(left_out)}" if left_out else "all"


if __name__ == "__main__":
    rows = {python: found(python) for python in PYTHONS}
    print(*(f"Python {python}: {words}" for python, (_, words) in rows.items()), sep="\n")
    sys.exit(not all(works for works, _ in rows.values()))
