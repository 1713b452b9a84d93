"""Track geometry: how uneven a line becomes under its axles, and when it has to be tamped.

A rail on pads, sleepers and beds that only push; each bed settles by a law of its load and its
history.  Start with `track_line.scene`, or from Python with `track_line.settling`.
"""

from trackbed.cache_folders import provide_cache_folders

provide_cache_folders(__path__[0])
