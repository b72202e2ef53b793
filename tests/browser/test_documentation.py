"""The JavaScript of the documentation runs in a page of the service."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser.test_page import PATIENCE, browser, pytestmark, serving
from tests.test_documentation import PAGES, ROOT, blocks, name

__all__ = ["browser", "pytestmark"]

CLIENT = ROOT / "clients" / "javascript" / "README.md"
WITH_CODE = [page for page in (*PAGES, CLIENT) if page.is_file() and blocks(page, "js")]
# What the code of a page takes from the page around it.
AROUND = "globalThis.head = { morphTargetDictionary: { jawOpen: 0 }, morphTargetInfluences: [0] };"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving([sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent"]) as address:
        yield address


@pytest.mark.parametrize("page", WITH_CODE, ids=name)
def test_javascript_of_a_page_runs(page: Path, browser, address: str) -> None:  # type: ignore[no-untyped-def]
    opened = browser.new_page(bypass_csp=True)
    opened.set_default_timeout(PATIENCE)
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    opened.goto(f"{address}/healthz")
    opened.add_script_tag(content=AROUND)
    for block in blocks(page, "js"):
        code = block.replace("http://127.0.0.1:8765", address)
        code = code.replace("ws://127.0.0.1:8765", address.replace("http", "ws"))
        code = re.sub(r'"bml-realizer-client"', '"/realizer.js"', code)
        # A module that fails never gets to its last line.
        opened.add_script_tag(type="module", content=f"{code}\nglobalThis.finished = true;")
        opened.wait_for_function("globalThis.finished")
        opened.evaluate("globalThis.finished = false")
    opened.close()
    assert not faults
