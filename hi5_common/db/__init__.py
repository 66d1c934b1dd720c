"""The rows that are the truth. The only package that imports SQLAlchemy."""
