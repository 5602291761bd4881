"""Learned policies: what they are given, what they answer, and files of them as controllers."""
