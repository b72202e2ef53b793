"""What a face does by itself: blinks, small head motion, saccades, motion that goes with speech."""
