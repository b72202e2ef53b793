"""The application that servers import."""

import subprocess
import sys

import pytest

starlette = pytest.importorskip("starlette.applications", reason="needs the asgi extra")


def test_asgi_has_an_application_with_the_settings_of_the_environment(monkeypatch) -> None:
    from realizer import asgi

    assert isinstance(asgi.app, starlette.Starlette)
    assert asgi.create_app is not None


def test_asgi_without_starlette_says_what_to_install() -> None:
    script = "import sys; sys.modules['starlette'] = None; import realizer.asgi"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert "realizer.asgi needs the asgi extra: pip install 'bml-realizer[asgi]'" in done.stderr
