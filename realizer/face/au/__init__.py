"""The face model by action units: measured displacements in, functions that move any mesh out."""
