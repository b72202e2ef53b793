"""Messages and frames of the wire, which client and server share."""
