"""What decides whether a robot may move, and torque itself; to be read in this order.

`deadlines` holds every time that matters while servos have torque, and their order. `channel`
judges the readings of one antenna, `signal_quality` those of both. `causes` lists what can be
wrong, the state that each cause asks for, and its cure. `controller` asks for a command and
survives what it does. `supervisor` decides upon all of that in every tick: the state, and with it
torque. `session` carries the decision out, and `torque` alone writes it to servos.

Torque comes on in one tick alone: that of an arm event (`drive --arm`, after the dry run) against
which no cause speaks. All servos get it, or none. A leg that forgets its turns gets back what was
taken from it for that. `jog` gives it to one joint, slow and weak, without a supervisor: a person
is there.

Torque goes off, by a packet whose effect is read back,

- in the tick in which the state becomes OFF: the supply is empty, or the operator says stop;
- at the end of a drive, whatever ends it, after the robot has stood for `--stand`;
- for all, when one servo did not take what arming needs;
- for one leg after the other, while legs forget their turns.

A servo that did not confirm it is told again in every tick. FAULT keeps torque on, so that a robot
does not fall; `drive` ends `--fault-time` later. In a tick without a decision nothing is sent, and
after 0.1 s without a packet, as when program, bus or computer die, the watchdogs of the servos stop
them where they are, with torque. A servo in overload or heat takes its torque off by itself.
"""
