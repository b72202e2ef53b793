"""The service: sessions that know no sockets, and the one place that does."""
