"""A robot arm, and a scanner or a tracker on its flange.

arm            Denavit-Hartenberg kinematics, smooth motions, the Staubli TX40
triangulation  height from two angles
robot_accuracy kinds of accuracy, of poses and paths
packet         the tracker's packets
log            its logs, and the means of its stops
mounting       where the tracker sits on the flange, by the report's method
accuracy       how well it follows a motion
simulation     its errors, simulated
udp            its packets as a live stream
"""
