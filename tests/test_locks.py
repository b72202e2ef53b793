"""The lock files: they pin what pyproject.toml asks for, by hashes, and name no index."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest
from packaging.utils import canonicalize_name

from tests.locks import HEAD, LOCKS, PYTHON, ROOT, requirements


def pins(text: str) -> Mapping[str, tuple[str, list[str]]]:
    """Return name -> version, hashes."""
    found = {}
    for block in re.split(r"\n(?=\S)", text):
        if pin := re.match(r"([\w.-]+)(?:\[[\w,]+\])?==(\S+)", block):
            found[canonicalize_name(pin[1])] = pin[2], re.findall(r"--hash=sha256:[0-9a-f]{64}", block)
    return found


@pytest.mark.parametrize("file", LOCKS)
def test_lock_covers_what_the_project_asks_for(file: str) -> None:
    text = (ROOT / file).read_text("utf-8")
    assert text.startswith(HEAD.format(", ".join(LOCKS[file])))
    found = pins(text)
    for requirement in requirements(PYTHON, LOCKS[file]):
        version, hashes = found.get(canonicalize_name(requirement.name), ("none", []))
        message = f"{file} has {requirement.name} {version}, wanted {requirement}: run python -m tests.locks"
        assert hashes, message
        assert requirement.specifier.contains(version, prereleases=True), message


@pytest.mark.parametrize("file", LOCKS)
def test_lock_pins_files_and_names_no_address(file: str) -> None:
    text = (ROOT / file).read_text("utf-8")
    assert not re.search(r"://|index|^-", text, re.M)
    assert all(hashes for _, hashes in pins(text).values())
    assert len(pins(text)) == len(re.findall(r"^[A-Za-z]", text, re.M))
