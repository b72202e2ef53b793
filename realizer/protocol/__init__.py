"""The protocol that clients and the service share: messages, streams, binary frames."""
