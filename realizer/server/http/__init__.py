"""Everything on the service's port: the application, access, the page, WebSockets, metrics, the server."""
