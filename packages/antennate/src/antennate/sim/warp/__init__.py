"""Thousands of simulated robots at once with MuJoCo Warp, on a GPU; see docs/gpu.md.

The only place that imports warp and mujoco_warp, and only when a batch is made.
"""
