"""Tools that make face folders; nothing that plays imports this package."""
