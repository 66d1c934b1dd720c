"""The nemesis: hi5's real processes over real servers, faults without end, and who checks."""
