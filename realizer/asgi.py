"""The service as an ASGI application: `uvicorn realizer.asgi:app`, or mounted in an application of your own.

Its settings are REALIZER_* variables, as for `realizer serve`; `create_app(settings)` takes others.
"""

from realizer.core.threads import use_one_thread

use_one_thread()  # before numpy is loaded

from realizer.server.http.app import create_app  # noqa: E402

__all__ = ["app", "create_app"]

app = create_app()
