"""Virtual DYNAMIXEL servos behind a TCP port, and a master that reads and moves them.

No robot, no antennae: servos in one thread, a client in the other. Run: python servo_bus.py
"""

from __future__ import annotations

import threading
import time

from dynamixel_bus.answers import POSITION, Timing, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.endpoints import TcpEndpoint
from dynamixel_bus.faults import Fault, Trouble
from dynamixel_bus.models import servo_model
from dynamixel_bus.ports import TcpPort
from dynamixel_bus.server import Server
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

IDS = (1, 2, 3)
MODEL = servo_model("xl430-w250")


def positions(bus: Bus) -> dict[int, int | None]:
    """Where each servo is [ticks], None for one that does not answer."""
    here = MODEL["present_position"]
    answers = bus.read_all(IDS, POSITION, budget=0.5)
    return {i: here.decode(a.data) if isinstance(a, Value) else None for i, a in answers.items()}


def move(bus: Bus) -> None:
    """Torque on, then one goal for each servo in one packet."""
    torque, goal = MODEL["torque_enable"], MODEL["goal_position"]
    bus.write_all(torque.address, {i: torque.encode(1) for i in IDS})
    bus.write_all(goal.address, {i: goal.encode(2048 + 100 * i) for i in IDS})


servos = [Servo(MODEL, i) for i in IDS]
wire = ServoBus(servos)
done = threading.Event()
with Server(wire, TcpEndpoint("127.0.0.1", 0)) as server:
    thread = threading.Thread(target=server.run, args=(lambda t: not done.is_set(),))
    thread.start()
    host, _, port = server.paths["bus"].removeprefix("tcp://").rpartition(":")
    line = TcpPort(host, int(port))
    bus = Bus(line, Timing(gap=0.1, latest=0.5))  # patient: the computer may be busy
    print("ids that answer a ping:", sorted(status.id for status in bus.scan()))
    print("before:", positions(bus))
    move(bus)
    time.sleep(1.0)
    print("after:", positions(bus))
    servos[1].trouble = Trouble(Fault.SILENT)
    print("one is silent:", positions(bus))
    line.close()
    done.set()
    thread.join()
