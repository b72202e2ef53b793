"""One session: messages in, effects to carry out; no sockets and no clock."""
