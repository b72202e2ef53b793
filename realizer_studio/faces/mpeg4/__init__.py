"""MPEG-4 facial animation on any head: zones of influence, displacement fields and scores."""
