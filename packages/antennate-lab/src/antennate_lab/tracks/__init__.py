"""Antennae from tracking software: their shapes in contact.

It takes files of DeepLabCut, SLEAP and TRex, and plain CSV, such as the points of simulated
antennae that `bench sweep --points` saves. Body axis, antenna and wall follow from points that you
name. Contact is divided into forward pointing, backward pointing, straight and transition, and
every criterion is varied to show how much depends on it. Without files, a synthetic animal of known
shapes, with errors like those of a trained network, shows how many frames are classified correctly.
"""
