"""Orders of images in which every attribute's shares hold at any length: see weave.py."""
