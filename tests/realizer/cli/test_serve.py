"""Tests of `realizer serve`."""

from __future__ import annotations

import shutil
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from realizer.cli import cli
from realizer.core.settings import Settings
from realizer.face.load import folder_of
from realizer.server import serve


def settings_of(monkeypatch: pytest.MonkeyPatch, *args: str) -> Settings:
    """Return the settings that `realizer serve` starts a service with."""
    got: list[Any] = []
    monkeypatch.setattr(serve, "serve", got.append)
    monkeypatch.setattr(serve, "run", lambda service: None)
    done = CliRunner().invoke(cli, ["serve", "--voice", "silent", *args], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    (settings,) = got
    return settings


LIMITS = [f for f in fields(Settings) if f.name.startswith("max_")]


@pytest.mark.parametrize("limit", LIMITS, ids=lambda f: f.name)
def test_serve_has_an_option_for_every_limit(limit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_of(monkeypatch, f"--{limit.name.replace('_', '-')}", "321")
    assert getattr(settings, limit.name) == 321
    assert settings_of(monkeypatch) == Settings(voice="silent")


@pytest.mark.parametrize("limit", LIMITS, ids=lambda f: f.name)
def test_serve_refuses_an_invalid_limit(limit: Any) -> None:
    flag = f"--{limit.name.replace('_', '-')}"
    done = CliRunner().invoke(cli, ["serve", flag, "much"])
    assert done.exit_code == 2
    assert f"setting {limit.name}: wanted a" in done.stderr
    assert "got 'much'" in done.stderr


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--host", "0.0.0.0"], "setting host: wanted token, jwt_key or insecure too"),
        (["--host", "::", "--workers", "2"], "setting host: wanted token, jwt_key or insecure too"),
        (["--host", "0.0.0.0", "--token", "x", "--xface-port", "0"], "setting xface_port: wanted allow or"),
    ],
)
def test_serve_refuses_to_listen_beyond_this_machine_unprotected(options: list[str], says: str) -> None:
    done = CliRunner().invoke(cli, ["serve", *options])
    assert done.exit_code == 2
    assert says in done.stderr


def test_serve_listens_beyond_this_machine_with_its_options(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_of(monkeypatch, "--host", "0.0.0.0", "--insecure", "--hosts", "a.example,b.example")
    assert (settings.insecure, settings.hosts) == (True, ("a.example", "b.example"))
    allowed = settings_of(
        monkeypatch, "--host", "::", "--token", "x", "--asap-ports", "0", "1", "--allow", "192.0.2.1"
    )
    assert allowed.allow == ("192.0.2.1/32",)


def test_serve_takes_the_path_of_a_face(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("REALIZER_FACES", "")
    shutil.copytree(folder_of("ada"), tmp_path / "mia")
    assert settings_of(monkeypatch, "--face", str(tmp_path / "mia")).face == "mia"
    assert folder_of("mia") == tmp_path / "mia"
    done = CliRunner().invoke(cli, ["serve", "--face", str(tmp_path / "no")])
    assert done.exit_code == 2
    assert "no such face folder" in done.stderr
