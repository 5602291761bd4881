"""Draw an antenna with each of five profiles along boulders.

An antenna at a fixed angle moves along touching spheres. It jams if its tip stays while the base
goes on, slips if it touches nothing for long, and succeeds if it does neither. The profiles are the
paper's three and two controls; all meet the same walls and disturbances.
"""
