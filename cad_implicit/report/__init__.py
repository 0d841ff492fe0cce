"""Reports: what an operation did and how far it is from the truth."""
