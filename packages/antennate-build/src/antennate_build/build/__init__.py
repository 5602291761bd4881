"""Parts of a robot or antenna: STEP, STL, springs, drawings, a bill.

FILE is a robot, by its name or TOML file, or an antenna alone (the keys of [antenna]). Printed
parts and springs of stock wire follow from the numbers with which it is simulated. The folder
holds stl/ and step/, drawings as SVG, PNG and PDF, assembly.md with the steps, and bom.csv, whose
column of costs is left empty.

The geometry is checked: no parts meet at any angle of their joints, walls are thick enough, what
overhangs is told, meshes are closed, and mass and inertia stand beside those of the simulation. The
exit code is 2 if parts meet, or a mesh has holes.
"""
