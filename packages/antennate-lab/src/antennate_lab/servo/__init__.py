"""A servo model against recordings of a real servo.

Goals of a recording are told to the model, and its positions compared with the measured ones while
torque is on; simpler models stand beside it. With --fit the model is identified from the
recordings, with 95 % intervals, and judged on what it was not fitted on: each gain is left out in
turn. A recording is JSON as the project Rhoban/bam writes it.
"""
