"""The messages of the WebSocket protocol, as models: requests in, replies out, JSON text to either."""
