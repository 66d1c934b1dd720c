"""Run time against error: what `hi5 bench render` measures."""
