"""What decides whether a robot may move, and torque itself; to be read in this order.

`deadlines` holds every time that matters while servos have torque, and their order. `channel`
judges the readings of one antenna, `signal_quality` those of both, `following` the joints: a joint
whose servo gives less drive than its error asks for is not driven, and one that pushes in a corner
drives with all it has. `causes` lists what can be wrong, the state that each cause asks for, and
its cure. `controller` asks for a command and survives what it does. `supervisor` decides upon all
of that in every tick: the state, and with it torque. `session` carries the decision out through
`hardware.actuators.Actuators`, whose only means to write torque and goals is `torque`.

Torque comes on by an arm event (`drive --arm`, after a dry run that reads everything and moves
nothing) against which no cause speaks; by nothing else while the robot walks. A zero or a direction
that nobody has measured speaks against it (`Session.unfit`). All servos get it, or none. A leg that
forgets its turns (after a restart its servo counts from the nearest one) gets back what was taken
from it for that. `setup jog` gives torque to one joint, slow and weak, without a supervisor: a
person is there.

Torque goes off, by a packet whose effect is read back,

- in the tick in which the state becomes OFF: the supply is empty, or the operator says stop;
- at the end of a drive, whatever ends it, after the robot has stood for `--stand`, 2 s at most;
- for all, when one servo did not take what arming needs;
- for one leg after the other, while legs forget their turns.

A servo that did not confirm it is told again in every tick. FAULT keeps torque on, so that a robot
does not fall; `drive` ends `--fault-time` later. In a tick without a decision no goal is sent, and
while torque is on no other packet either; after 0.1 s without a packet, as when program, bus or
computer die, the watchdogs of the servos stop them where they are, with torque. Then only the
supply takes it off, and a servo in overload or heat its own.

With the parameters as they are (`params.safety`, at 100 Hz) a silent board is HOLD after 0.05 s, a
silent servo FAULT after 5 missed answers, a joint that is not driven FAULT after 0.1 s, one that is
stuck after 2 s of moving goals, and a loop that stood for 0.12 s FAULT. A HOLD for lost data ends
by itself after 10 good samples in a row, another with its cause; the third within 10 s is FAULT,
which only an arm event ends. Holds because a key is released do not count.
"""
