"""The service over HTTP: page, tools, access control, metrics."""
