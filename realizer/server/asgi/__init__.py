"""The service as an ASGI application, under uvicorn or inside another application."""
