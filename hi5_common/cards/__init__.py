"""A dataset's card: a datasheet for people, Croissant for machines, licences for lawyers."""
