"""What the delivered labels and pixels of a dataset say of its balance: numbers and plain words."""
