"""The doors of the service: one module each, all of them leading into the same sessions."""
