"""A robot arm, and a scanner or a tracker on its flange.

arm            Denavit-Hartenberg kinematics, smooth motions, the Staubli TX40
triangulation  height from two angles
robot_accuracy kinds of accuracy, of poses and paths
packet         the tracker's packets
log            its logs, and the means of its stops
mounting       where the tracker sits on the flange, by the report's method
stations       base stations: sweeps become angles, rays, places, poses
tracking       how well it follows a motion
simulation     its errors, simulated
udp            its packets as a live stream
cell           one cell from frames to tip: a part found with all of its calibrations, and the budget
sensor_cell    a synthetic cell to be measured as often as one likes
"""
