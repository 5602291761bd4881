"""What decides whether a robot may move, and torque itself; to be read in this order.

`deadlines` holds every time that matters while servos have torque, and their order. `causes` lists
what can be wrong, and the state that each asks for. `channel` judges the readings of one antenna,
`signal_quality` those of both. `controller` asks for a command and survives what it does.
`supervisor` decides upon all of that in every tick: state, and with it torque. `session` carries
the decision out, and `torque` alone writes it to servos.

Torque comes on in one tick alone: that of an arm event (`drive --arm`, after the dry run) to which
no cause objects. A leg that forgets its turns gets back what was taken from it for that.

Torque goes off by a packet that is read back when the state is OFF, at the end of a drive however
it ends, when a servo did not take what arming needs, and for one leg at a time that forgets its
turns. FAULT keeps it on, so that a robot does not fall; `drive` ends some seconds later. Without
any packet for 0.1 s, as when program, bus or computer die, the watchdogs of the servos stop them
where they are, with torque.
"""
