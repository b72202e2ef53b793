"""Pydantic models of the WebSocket protocol's messages, and the parser of requests."""
