"""What the Face tab of the page asks of the service."""
