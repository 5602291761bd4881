"""Flex to counts: curve, hysteresis, creep, noise, best divider.

The flex sensor on its own: resistance, voltage and reading over the flex, hysteresis in a slow
loop, creep and noise under a held flex, and the fixed resistor that spreads readings farthest.
"""
