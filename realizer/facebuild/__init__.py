"""Making face folders; nothing that runs imports this package."""
