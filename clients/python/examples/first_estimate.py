"""The shortest whole program: say where the robot starts and how it moved, print where it is."""

import argparse

import cogmap

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--connect", default=cogmap.DEFAULT_ENDPOINT, help="Zenoh endpoint")
parser.add_argument("--space", default="default")
parser.add_argument("--agent", default="ada")
args = parser.parse_args()

with cogmap.Robot(args.space, args.agent, connect=args.connect) as robot:
    robot.start_pose([0, 0, 0])
    robot.velocity([0.5, 0, 0], [0, 0, 0.1], duration_s=0.1)
    robot.flush()
    print(robot.estimate())
