"""How much of a contact's force the flex tells.

Antennae of every profile are pressed at many places, by statics and by dragging them past a post.
R2 says how much of the force the flex tells: that of the best increasing curve, on loads it was not
fitted to, with one curve for every place and with one for all places.
"""
