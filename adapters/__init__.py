"""Settlement of granular beds under cyclic load, computed by an engine as it is installed."""

from trackbed.cache_folders import provide_cache_folders

provide_cache_folders(__path__[0])
