"""Dirty input: parts that are broken, awkward, or made to do harm, and what becomes of each."""
