"""The live view: a page of this computer that shows a robot while it walks.

A process of its own serves the page. A loop or a simulation sends it small messages and never
waits for it.
"""
