"""A worker in the fleet: lease a shard, have a child process render it, pack it, publish it."""
