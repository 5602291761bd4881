"""Climb steps: what feeling the ground buys.

Robots whose links pitch meet steps of several heights. `locked` cannot pitch, `level` does not,
`lifted` and `rhythm` feel nothing, `climb` feels steps with lowered antennae, `edges` is told by
the simulation where they are. All meet the same steps, starts and disturbances. A trial succeeds
when all links stand behind and above the step. So do other grounds, as gaps, steps down, stairs,
ramps and a tunnel with a step, and speed is measured on the flat floor. The last part asks what
`climb` feels of floors, steps, drops and walls.
"""
