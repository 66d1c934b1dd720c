"""What can be switched off in a test's own processes, by the name that NEMESIS_BROKEN gives."""

VARIABLE = "NEMESIS_BROKEN"

FENCING = "fencing"
"""Worker: publishes whatever became of its lease."""
VERIFY = "verify"
"""Worker: believes what the store answers to an upload."""
STOPPED_BEFORE_FINISH = "stopped_before_finish"
"""Worker: a fault point. A pool process stops (SIGSTOP) once, after the uploads of a shard."""
LEASE_SWEEPER = "lease_sweeper"
"""Keeper: takes no shard back."""
OBJECT_SWEEPER = "object_sweeper"
"""Keeper: removes no object."""
