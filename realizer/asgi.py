"""The service as an ASGI application: `uvicorn realizer.asgi:app`, or mounted in an application of your own.

Its settings are REALIZER_* variables, as for `realizer serve`; `create_app(settings)` takes others.
"""

from realizer.core.threads import use_one_thread

use_one_thread()
try:
    from realizer.server.http.app import create_app
except ImportError as error:
    if error.name is None or error.name.partition(".")[0] != "starlette":
        raise
    raise ImportError("realizer.asgi needs the asgi extra: pip install 'bml-realizer[asgi]'") from None

__all__ = ["app", "create_app"]

app = create_app()
