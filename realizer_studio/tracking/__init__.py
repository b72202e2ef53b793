"""Tracking of faces in pictures and films: landmarks, head pose, gaze, action units and FAPs."""
