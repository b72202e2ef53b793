"""The application that servers import."""

from starlette.applications import Starlette


def test_asgi_has_an_application_with_the_settings_of_the_environment(monkeypatch) -> None:
    from realizer import asgi

    assert isinstance(asgi.app, Starlette)
    assert asgi.create_app is not None
