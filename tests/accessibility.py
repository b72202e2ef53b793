"""Faults of a page for people who use it with other tools than their eyes and a mouse, found by axe."""

from typing import Any

import pytest


def serious_faults(page: Any, **options: Any) -> list[str]:
    """Return rule and HTML of each fault of a page of Playwright that is serious, or that stops a keyboard.

    Args:
        options: of axe, such as `runOnly`.
    """
    axe = pytest.importorskip("axe_core_python.sync_playwright", reason="needs the test extra").Axe()
    found = axe.run(page, options={"resultTypes": ["violations"], **options})["violations"]
    return [
        f"{fault['id']}: {fault['nodes'][0]['html'][:200]}"
        for fault in found
        if fault["impact"] in ("serious", "critical") or fault["id"] == "scrollable-region-focusable"
    ]
