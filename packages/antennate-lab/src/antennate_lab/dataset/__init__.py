"""Data of touch with labels: distance, angle, gap, place of contact.

The robot walks beside a wall, its antennae sweep in a gap, its head turns against a post. What it
reads and what was true go into Parquet files with fixed splits, and simple estimates show what is
to be beaten. Definitions: docs/dataset.md.
"""
