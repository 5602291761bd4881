"""Rank controllers on the same scenes, with public or hidden seeds.

Every controller meets the same draws of every scene, in processes of its own, and has a time limit
for each decision. A controller that needs what only a simulation knows is given it, and stands
outside the ranking. A scene may have other parameters than its own, as
`uturn+variation.broken=random`. `--check FILE` runs the rows of somebody's result again and says
which differ.
"""
