"""The doorbell: it tells workers to look into the database, and may be lost without harm."""
