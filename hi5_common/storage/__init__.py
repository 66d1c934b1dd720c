"""Where published bytes live: a folder, an S3 bucket, or memory for tests."""
