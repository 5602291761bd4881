# ruff: noqa: E501
"""Words that a command refuses: one line each, with what was expected and what was found.

A line of the table holds the words, and what stands in the line that refuses them, after `::`. A
refused command asks nobody anything and leaves nothing behind.
"""

from __future__ import annotations

import io
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

NAMES = """
tunel :: antennate: error: :: did you mean tunnel? :: found tunel
study megre :: did you mean merge? :: found megre
setup zreo :: did you mean zero? :: found zreo
log veiw a.mcap :: did you mean view? :: found veiw
'' :: expected a command :: found ''
wall --trials 5 :: antennate: error: wall is ` :: antennate bench wall` now
zero :: antennate: error: zero is ` :: antennate setup zero` now
bench wal :: antennate bench: error: expected a command (did you mean wall?), one
--completion :: expected one of bash, zsh, fish
--completion tcsh :: expected one of bash, zsh, fish
--completion bash zsh :: expected one of bash, zsh, fish
tunnel --trails 3 :: did you mean --trials? :: found '--trails'
tunnel --tunnel.free_widht=1 :: did you mean --tunnel.free-width?
tunnel --free-width 1 :: did you mean --tunnel.free-width or --corridors.free-width?
tunnel --arms open :: did you mean --controllers? :: found '--arms'
bench wall --arms stiff :: did you mean --profiles? :: found '--arms'
bench wall --solver chain :: expected a known flag (it is gone: leave it out), found '--solver'
bench sweep --solver mujoco :: it is gone: leave it out
calibrate --solver=mujoco :: it is gone: leave it out
tunnel --bogus :: expected a known flag, found '--bogus'
gait --tunnel.free-width 1 :: expected a known flag
antenna --video :: expected a flag of this command, found --video
gait --video :: expected a flag of this command, found --video
"""
VALUES = """
tunnel --json yes :: expected flags only, found 'yes'
tunnel stray :: expected flags only :: 'stray'
tunnel --out '' :: --out: expected a path, found nothing
tunnel --tunnel.mirror often :: expected one of random, never or always
gait --config fitted :: expected a FILE, found fitted, a word that only these take :: bench wall
tunnel --trials many :: --trials: expected a whole number, found many
tunnel --seed '' :: --seed: expected a whole number, found ''
tunnel --robot '' :: --robot: expected  :: found nothing
tunnel --robot scutle :: expected scuttle, scuttle3d, hexapod, bench or a TOML file :: did you mean scuttle
tunnel --trials :: --trials: expected 1 value, INT, found none
tunnel --trials 0 :: --trials: expected a number of at least 1, found 0
tunnel --controllers dance :: controllers: expected one of open, timed, paper, closed, :: dance
tunnel --controllers open open :: controllers must differ
tunnel --workers 0 :: --workers: expected a number of at least 1, found 0
tunnel --tunnel.free-width -0.4 :: tunnel: error: --tunnel.free-width: expected a number above 0, found -0.4
tunnel --tunnel.free-width nan :: expected a finite number, found nan
tunnel --tunnel.turns-deg 200 :: error: tunnel: turns_deg must lie within -120
tunnel --tunnel.free-width 0.1 :: at least robot.width, 0.2 m, found 0.1 m
tunnel --tunnel.strewn 40 :: tunnel.strewn asks for 40
tunnel --control.rate 333 :: whole fraction of the physics rate
tunnel --config missing.toml :: missing.toml: expected a readable file: No
tunnel --config . :: .: expected a readable file
tunnel --scene tunnle :: --scene: expected one of tunnel, :: did you mean tunnel?
tunnel --scene flat --tunnel.strewn 2 :: tunnel belongs to the scene
tunnel --scene no_such_module:Scene :: no_such_module
gait --cycles x :: antennate gait: error: --cycles: expected a whole number, found x
gait --rate 300 :: whole fraction of the physics rate 500 Hz
twin --fault esp32=loose servo:7=silent --duration 0.01 :: found loose
twin --fault servo:7=silent --fault esp32=loose --duration 0.01 :: found loose
tunnel --readings yoked --trials 1 :: expected trials of at least 2
tunnel --readings delayed:-1 :: expected delayed:S with seconds above 0
tunnel --readings delayed:x :: expected delayed:S with seconds above 0
tunnel --readings delayed:1e-9 :: of whole control periods of 0.01 s
tunnel --readings delayed:0.012 :: of whole control periods of 0.01 s
tunnel --readings delayed :: expected delayed:S with seconds above 0
tunnel --readings yokde :: did you mean yoked?
tunnel --readings own own :: readings must differ
"""
LISTS = """
tunnel --controllers open,closed :: tunnel: error: --controllers: expected values separated by spaces, as --controllers open closed, found 'open,closed'
tunnel --controllers open, closed :: expected values separated by spaces, as --controllers open closed, found 'open, closed'
twin --servos 1:xl330-m288,2:xl430-w250 :: --servos: expected values separated by spaces, as --servos 1:xl330-m288 2:xl430-w250, found '1:xl330-m288,2:xl430-w250'
record --marks 0,5 1,0 :: --marks: expected numbers separated by spaces, with decimal points, found '0,5 1,0'
"""
TOGETHER = """
tunnel --video-view side :: --video
tunnel --video-view below --video :: --video-view :: expected one of above or side
bench wall --video :: expected a flag of this command, found --video
log plot no.mcap --video-view side :: expected `film` beside it, found plot
tunnel --video-trial 0 --video --no-video :: beside it, found none
tunnel --slurm timeout_min=1 --engine dask :: beside it, found --engine dask
tunnel --slurm timeout_min=1 --engine=local :: beside it, found none
calibrate --rate 50 :: rate
calibrate --rate 50 --recording x --columns.time-unit ms :: expected none beside columns.time_unit
report :: expected the folder of a run, or --compare RUN RUN
report --compare a :: expected 2 runs, found 1
report run --compare a b :: expected no other run beside it
study :: expected a FILE that says what varies
study --out run :: expected a FILE that says what varies
study design plan.toml :: study design is a plan of `
design :: design is a plan of `
study nobody.toml :: nobody.toml: expected a readable file: No such file
bench touch --engine warp --trials 1 :: expected tunnel or a study of it
tunnel --engine warp:cpu --log --trials 1 :: warp, which keeps no logs
"""
KNOWLEDGE = """
drive --knows side :: --knows
drive --controller map :: found 'map', which needs what only a simulation knows
drive teleop --knows map :: --knows
twin --knows jam :: --knows
log replay --knows side log.mcap :: --knows
log replay --controller map log.mcap :: found 'map', which needs what only a simulation knows
tunnel --knows sight :: knows :: sight
tunnel --knows side side --controllers closed :: knows must differ
tunnel --knows side --controllers open closed :: open
tunnel --knows side map --controllers timed :: side :: map
tunnel --knows map --controllers timed closed :: closed
"""
NOT_READ = """
tunnel --controllers closed --control.rule.hold-time 3 :: rule.hold :: found 3 :: , but closed does not read it
tunnel --controllers open closed --control.rule.strong 0.8 :: rule.strong :: found 0.8 :: , but open and closed do
tunnel --control.gait.lift.stance 1 :: lift.stance :: found 1 :: , but legs that roll do not read it
drive --control.gait in_phase :: , but legs that roll do not read it
tunnel --robot.servos.xl430-w250.friction 0.05 :: friction :: found 0.05 :: , but no joint of the robot has this servo
twin --robot.servos.xl430-w250.p-gain 5 :: p-gain :: found 5 :: , but no joint of the robot has this servo
drive --control.rule.hold-time 3 :: hold-time :: found 3 :: , but closed does not read it
tunnel --robot.legs.reach 0.05 :: reach :: only legs of the kind lifting have it
drive --robot.legs.limit 1.2 :: limit :: found 1.2 :: but only legs of the kind lifting have it
twin --robot.pitch.kind actuated --robot.pitch.stiffness 20 :: stiffness :: found 20 :: , but only pitch joints of the kind locked have it
tunnel --controllers open --robot.antennae.kind none --robot.antenna.length 0.2 :: length :: found 0.2 :: but the robot has no antennae
drive --robot.antennae.kind none --robot.antennae.limit 1.0 :: limit :: found 1 :: the robot has no antennae
bench wall --antenna.base-angle 0.5 :: expected a parameter that bench wall reads, found this one
doctor --robot.mass 5 :: expected a parameter that doctor reads, found this one
drive --robot.leg-friction=0.5 :: expected a parameter that drive reads, found this one
drive teleop --controller open :: expected a parameter that drive teleop reads, found this one
drive teleop --protocol identify :: expected a parameter that drive teleop reads, found this one
drive --protocol identify --controller open :: found open :: , but a protocol takes its place
drive --protocol identify --control.gait.frequency 0.4 :: found 0.4 :: , but a protocol does not read it
drive --protocol identfy :: --protocol: expected identify, check or a TOML file (did you mean identify?) :: found 'identfy'
drive --protocol missing.toml :: missing.toml: expected a readable file
drive --protocol identify :: --esp32: expected a serial port, found none
drive --tell orders :: --tell: expected --protocol beside it, found none
drive --protocol identify --tell . :: --tell: expected a file, or a named pipe that :: found .: Is a directory
setup jog --robot.antenna.length 0.1 :: expected a parameter that setup jog reads, found this one
twin --control.gait.frequency 0.4 :: expected a parameter that twin reads, found this one
"""
HEXAPOD = """
tunnel --robot hexapod :: expected a robot with antennae for this controller, found one without
drive --esp32 /dev/null --bus /dev/zero --robot hexapod :: antennae for drive, found one
drive teleop --esp32 /dev/null --bus /dev/zero --robot hexapod :: antennae for teleop, found one
twin --robot hexapod :: expected a robot with antennae for the twin, found one without
gait --gait b12bl0 --robot hexapod :: (did you mean b11bl0?), found 'b12bl0'
gait --gait '' --robot hexapod :: expected serpenoid, swift, thrifty, b11bl0, in_phase or a TOML file
gait --draws 3 --robot hexapod :: draws: expected the default, as all is known
gait --unknown robot.mass --robot hexapod :: such as robot.leg_friction=0.18:0.25, found
gait --unknown robot.mass=2:1 --robot hexapod :: such as robot.leg_friction=0.18:0.25, found
gait --unknown robot.mas=1:2 --robot hexapod :: (did you mean robot.mass?), found 'robot.mas'
gait --unknown robot.links=2:4 --robot hexapod :: need not be whole, found 'robot.links'
gait --unknown robot.mass=0.1:2 --robot hexapod :: unknown: robot.mass: expected a number above
gait --unknown robot.mass=1:2 robot.mass=1:3 --robot hexapod :: unknown must differ
gait --robot.legs.reach 0.1 --robot hexapod :: legs.reach: expected at most 0.053 m
"""
CLIMB = """
climb --robot scuttle :: expected a robot with pitch joints and antennae that rise
climb --robot hexapod :: expected a robot with pitch joints and antennae that rise
climb --robot.servos.xc430-w240.gain-divisor 9 :: divisors says it
climb --heights 0.6 :: --heights: expected a number of at most 0.5, found 0.6
climb --robot.links 3 --heights 0.4 :: expected at most the length of the robot
climb --heights 0.05 0.05 :: heights must differ
climb --start 0.1 1 :: start must rise from at least 0.25 to at most 10 m, found 0.1
climb --start 0.35 :: --start: expected 2 values, found 1
climb --conditions fly :: expected one of locked, level, lifted, rhythm, climb or edges
climb --divisors 0 :: --divisors: expected a number above 0, found 0.0
climb --grounds gap:0.6 :: --grounds: gap: width: expected a number of at most 0.5
climb --grounds ramp:80 :: --grounds: ramp: slope: expected a number of at most 45
climb --grounds stairs:0 :: --grounds: stairs: height: expected a number of at least 0.001
climb --grounds gap:nan :: --grounds: gap: width: expected
climb --grounds gap :: expected flat or one of gap:WIDTH, step_down:HEIGHT
climb --grounds pond:1 :: found 'pond:1'
climb --grounds ramp:x :: expected a number after ramp:, found 'x'
climb --grounds gap:0.1 gap:0.10 :: grounds must differ, found gap:0.1, gap:0.1
climb --robot.links 3 --grounds gap:0.4 :: grounds: gap: expected at most the length of the robot, 0.36 m, found 0.4
climb --control.climb.low 0.2 :: control.climb: low: expected at most rise, 0.17 m, found 0.2
climb --control.climb.feel.touch 0.1 :: control.climb.feel: missing: expected less than touch, 0.1, found 0.14
geometry --gait.amplitude 0.6 :: gait.amplitude: expected at most 0.5087 rad
geometry --robot.links 1 :: links: expected at least 2, or 1 of a bench (legs.kind none), found 1
geometry --largest-amplitude 0.55 :: expected at most 0.5087 rad
gait --optimise speed --gait.amplitude 0.6 :: the limit of the yaw joints
gait --optimise fast :: speed
"""
BENCH = """
bench wall --profiles stiff stiff :: profiles must differ
bench wall --wall.overlap 0.09 :: overlap must stay below
bench wall --wall.travel 0.05 :: travel must exceed
bench wall --physics.timestep 0.0007 --physics.contact-time 0.0014 :: timestep must divide
bench touch --walls cliff :: --walls: expected one of flat, sinusoidal, boulders, step, gap or corner
bench touch --wall.boulders.pitch -0.01 :: --wall.boulders.pitch: expected a number of at least
bench touch --wall.gap.width 0.39 :: wall.gap.width: expected at most 0.36 m
bench touch --wall.corner.rise 0.07 :: before the wall corner
bench touch --wall-length 0.1 --walls flat :: wall.flat: expected at least 0.02 m
bench touch --walls boulders --wall.boulders.pitch 0.4 :: room for two spheres
bench touch --overlap 0.13 :: overlap: expected overlap and spread of at most
bench touch --overlap 0.01 :: overlap_spread: expected less than overlap
bench touch --speeds 0 :: expected a number of at least 0.002, found 0
bench touch --speeds 0.1 0.1 :: speeds must differ
bench touch --profiles soft :: --profiles: expected one of stiff
bench touch --trials 10000 :: trials: expected at most 10,000,000 ticks
bench force --nearest 0.8 :: nearest must not exceed from_place, 0.5, found 0.8
bench force --speeds 0.1 0.0 :: speeds must be above 0
bench force --traverses 7 --speeds 0.1 0.2 0.3 0.4 :: traverses: :: least 8, :: found 7
bench force --traverses 5 :: traverses: :: least 6, :: found 5
bench sweep --distances 0.01 :: distances must exceed the antenna's radius, 0.025 of its length
bench sweep --estimate.distance 0.9 0.4 :: estimate.distance must rise
bench sweep --antenna.sensor.rate 300 :: whole fraction of the physics rate 2000 Hz
bench sweep --estimate.trials 3 :: estimate.trials: expected a number of at least 6
tunnel --robot.antenna.sensor.kind fsr :: conditioning.polarity must be 1 for a fsr sensor :: found -1 :: antennate calibrate --antenna.sensor.kind fsr
bench touch --antenna.sensor.fixed-resistor supply :: conditioning.polarity must be 1 for a flex sensor :: found -1 :: --antenna.sensor.kind flex --antenna.sensor.fixed-resistor supply
"""
ANTENNA = """
antenna --coil-mm 1 :: coil_mm: expected 4 to 12 wire diameters
antenna --coil-mm 10 :: coil_mm: expected
antenna --index-limits 12 4 :: index_limits: expected the smaller first
antenna --coil-limits 9 9 :: coil_limits: expected the smaller first
antenna none.toml :: none.toml: expected a readable file
antenna --ladder-limits 9 3 :: ladder_limits: expected the smaller first
antenna --beside missing.toml :: missing.toml: expected a readable file
antenna --antenna.base-angle 0.5 :: --antenna.base-angle: expected a parameter that antenna reads
antenna --diameters-mm 1 :: --diameters-mm: expected
antenna springs :: antenna springs is `
antenna sensor --out run :: antenna sensor is `
ringdown :: ringdown is `
antenna --deflection -1 :: --deflection: expected a number above 0
antenna --config missing.toml :: missing.toml: expected a readable file
servo :: --recording: expected one file or more
servo --recording none.json :: none.json: expected a readable file
servo --servos.xc430-w240.armature 0.1 :: expected the default, as the servo is xl330
tracks --wall.kind line :: wall: expected the default, as it is not read without files
tracks --files a.npz --synthetic.trials 2 :: synthetic: expected the default
tracks --files a.npz --columns.x {}_cm :: columns: expected the default
tracks --files a.csv --columns.x x :: columns.x
tracks --files a.csv --wall.circle 1 2 3 :: kind: expected circle
tracks --files a.csv --criteria.gap 0.2 :: criteria.gap: expected the default
tracks --files a.csv --points.left a :: points: right: expected as many points
tracks --files a.csv --points.left a b --points.right none --criteria.flex 1 :: criteria.flex: expected the default, as it is not read with two points
"""
ROBOT = """
robot check :: error: expected scuttle, scuttle3d, hexapod, bench or a TOML file, found 'check'; a folder for the results is given as --out FOLDER
robot scutle :: error: expected scuttle, scuttle3d, hexapod, bench or a TOML file (did you mean scuttle?), found 'scutle'
robot --robot scutle :: error: --robot: expected scuttle, scuttle3d, hexapod, bench or a TOML file (did you mean scuttle?), found 'scutle'
robot --export mjcf elsewhere :: error: expected scuttle, scuttle3d, hexapod, bench or a TOML file, found 'elsewhere'; a folder for the results is given as --out FOLDER
robot hexapod scuttle :: expected flags only, found 'scuttle'; a folder for the results is given as --out FOLDER
robot --export mjc :: --export: expected one of mjcf or urdf, found mjc; a folder for the results is given as --out FOLDER
robot --export mjcf --scene tunle :: --scene: expected one of tunnel, :: did you mean tunnel?
robot --export mjcf --scene tunnel --robot.width 0.5 :: at least robot.width, 0.5 m, found 0.4 m
robot --export mjcf --scene tunnel --seed -4 :: --seed: expected a number of at least 0, found -4
robot --export mjcf --seed 4 :: --seed: expected --scene beside it, found none
robot --export mjcf --gait trot :: --gait: expected serpenoid, :: found 'trot'
robot --export urdf --scene tunnel :: --scene: expected --export mjcf beside it, found --export urdf
robot --export urdf --robot hexpod :: --robot: expected scuttle, :: (did you mean hexapod?), found
robot --scene tunnel :: --scene: expected --export mjcf beside it, found none
robot one two :: expected flags only, found 'two'
doctor :: --esp32 PORT, --bus PORT or both
doctor --compare fit.toml :: --compare: expected FILE and LOG, found no log :: drive --protocol check` records one
doctor --compare fit.toml . :: .: expected a run with a log, found none :: drive --protocol check` records one
fit . :: .: expected a run with a log, found none :: drive --protocol identify` records one
doctor drive.mcap :: --log: expected --compare
doctor --compare nowhere.toml drive.mcap :: nowhere.toml: :: No such file
doctor --compare hexapod drive.mcap :: hexapod: expected intervals of servos, tables [[fitted]] :: found none
doctor --bus /dev/null --esp32 /dev/null :: expected two ports
drive --esp32 /dev/null --bus /dev/null :: expected two ports, found /dev/null twice
doctor --esp32 /dev/null --fix :: --fix: expected --bus PORT
doctor --bus /dev/null --yes :: --yes: expected --fix
doctor --bus /dev/null --fix :: --fix: expected a terminal
doctor --bus /dev/null --robot.baud 7 :: --robot.baud: expected one of
doctor --insecure-udp --esp32 /dev/nowhere :: --insecure-udp: expected
doctor --esp32 udp://127.0.0.1:1 --out x :: --key: expected a file
doctor --esp32 udp://127.0.0.1:1 --out x --insecure-udp --key k :: expected no --key beside it
record --esp32 udp://127.0.0.1:1 --out x :: --key: expected a file
record --esp32 udp://127.0.0.1:1 --out x --insecure-udp --key k :: expected no --key beside it
record --out x.csv :: --esp32: expected a serial port
record --esp32 /dev/null :: --out: expected a CSV file
record --esp32 /dev/null --out x.csv :: /dev/null: not a serial port
record --marks 1 1 :: marks must be two different values
record --marks 1 2 --speed 0.1 :: expected marks or speed
drive --key k --esp32 /dev/nowhere --bus /dev/null :: --key: expected
drive --bus y --esp32 udp://127.0.0.1:4210 :: ANTENNATE_KEY set
drive --bus y --esp32 ftp://127.0.0.1:4210 :: expected a path, tcp:// or udp://
drive --bus y --esp32 rfc2217://127.0.0.1:4210 :: tcp://HOST:PORT, of ser2net in raw mode
drive --bus y --esp32 tcp://127.0.0.1 :: ://HOST:PORT such as
drive --bus y --esp32 tcp://key@127.0.0.1:4210 :: a key never goes there
drive --bus y --esp32 tcp://127.0.0.1:1 :: could not open tcp://127.0.0.1:1
drive --esp32 x --bus udp://127.0.0.1:1 :: it loses packets
drive --bus y --esp32 udp://127.0.0.1:1 --insecure-udp --key k :: expected no --key beside it
drive --esp32 x --bus y --limits.longest-pause 0.1 :: the servos at 0.1 s, limits.longest_pause at 0.1 s
drive --esp32 x --bus y --control.rate 12 :: control.rate at 0.0833333 s, the latest answer at 0.07 s
drive --esp32 x --bus y --stand 2.1 :: --stand: expected a number of at most 2
drive --esp32 x --bus y --hold-to-run :: --hold-to-run: expected a terminal as standard input, whose keys can be held, found none
"""
TWIN = """
twin --servos '' :: --servos: expected
twin --tcp '' :: --tcp: expected
twin --udp '' :: --udp: expected
twin --orders '' :: --orders: expected
twin --orders none/orders :: none/orders: No such file or directory
twin --key k :: --key: expected
twin --tcp=: :: expected [HOST:]PORT
twin --tcp=0.0.0.0 :: expected [HOST:]PORT
twin --tcp=127.0.0.1:70000 :: expected [HOST:]PORT
twin --tcp=a:b :: expected [HOST:]PORT
twin --fault imu=silent --duration 0.01 :: --fault: expected a robot with an inertial sensor (robot.imu.kind), found one without for imu=silent
twin --fault imu=hum --robot scuttle3d --duration 0.01 :: --fault: expected one of silent, stuck, railed, none for imu, found hum
tunnel --robot.imu.gyro-range 5 :: --robot.imu.gyro-range :: the robot has no inertial sensor
gait --robot hexapod --robot.imu.kind head :: imu.kind: expected none for a robot without antennae, on whose board it is, found head
tunnel --robot scuttle3d --robot.imu.gyro-step 1e-5 :: gyro_range: expected 1 to 32768 times gyro_step
drive --robot scuttle3d --robot.imu.gyro-noise 0.1 :: --robot.imu.gyro-noise
twin --fault esp32=plateau:4096 :: --fault: expected a code of 0 to 4095 :: found 'esp32=plateau:4096'
twin --fault esp32=plateau :: --fault: expected a code of 0 to 4095 :: found 'esp32=plateau'
twin --fault esp32=hum :: --fault: expected 0 to 65535 counts, as hum:SIZE :: found 'esp32=hum'
twin --fault esp32=radio_noise :: --fault: expected 0 to 65535 counts :: found 'esp32=radio_noise'
twin --fault esp32=drift :: --fault: expected at most 65535 counts a second :: found 'esp32=drift'
twin --fault esp32=drift:1e999 :: --fault: expected finite numbers :: found 'esp32=drift:1e999'
twin --fault esp32=left :: --fault: expected a reading of 0 to 65535 :: found 'esp32=left'
twin --fault esp32=right:-1 :: --fault: expected a reading of 0 to 65535 :: found 'esp32=right:-1'
twin --fault servo:7 :: expected TARGET=WHAT
twin --fault servo:7=asleep :: expected one of silent
twin --fault esp32=loss :: expected one of silent, reset
twin --fault servo:99=silent :: expected a servo of 1, 2
twin --fault esp32=ber :: --fault: expected a share of 0 to 1 :: found 'esp32=ber'
"""
DATASET = """
dataset --held-out-profile descending :: held_out_profile: expected another one than profile :: found descending twice
dataset --held-out-speeds 1.0 1.4 :: held_out_speeds: expected a range apart from speeds, 0.8 to 1.1 :: found 1 to 1.4
dataset --walk.windows 9 :: walk.time: expected room for 9 windows :: found 6 s
dataset --trials 5 :: --trials: expected a number of at least 10, found 5
dataset --kinds walk walk :: kinds must differ
dataset --gait.frequency 0.7 :: gait.frequency: expected at most 1 Hz :: found 1.05 Hz
dataset --robot.antenna.roll 0.5 :: robot.antenna.roll: expected 0 :: found 0.5
dataset --push.depth 0.3 0.1 :: push.depth: expected a range that rises, found 0.3 and 0.1
dataset --robot hexapod :: robot.antennae.kind: expected a pair of antennae, found none
dataset --bench.timestep 0.003 :: bench
dataset --antenna.radius 0.01 :: --robot.antenna.radius
"""
TOPICS = [
    NAMES,
    VALUES,
    LISTS,
    TOGETHER,
    KNOWLEDGE,
    NOT_READ,
    HEXAPOD,
    CLIMB,
    BENCH,
    DATASET,
    ANTENNA,
    ROBOT,
    TWIN,
]
COMPILED = """
robot --export mjcf --scene missing.xml :: missing.xml: expected a readable file
"""
"""Of files that a process of its own compiles first."""


def cases(topic: str, *marks: pytest.MarkDecorator) -> Iterator[Any]:
    """The lines of a topic: words, and what stands in the line that refuses them."""
    for line in topic.strip().splitlines():
        words, *parts = line.split(" :: ")
        yield pytest.param(words, parts, id=words or "none", marks=marks)


@pytest.mark.parametrize(
    ("words", "parts"),
    [*(case for topic in TOPICS for case in cases(topic)), *cases(COMPILED, pytest.mark.ci)],
)
def test_words_are_refused_in_one_line(
    words: str, parts: list[str], there: Path, refused: Callable[..., str], monkeypatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO())
    monkeypatch.delenv("ANTENNATE_KEY", raising=False)
    line = refused(*shlex.split(words))
    assert [part for part in parts if part.strip() not in line] == [], line
    assert list(there.iterdir()) == []
