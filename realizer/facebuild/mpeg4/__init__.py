"""MPEG-4 facial animation on any head: zones of influence in, displacement fields out; and their truth."""
