"""Rigid transforms.

frames      frames from measured points, poses, KUKA angles
lie         exponential and logarithm of SO(3) and SE(3)
planar      poses in the plane
chaining    products around a loop, their closure error, and how to share it out
propagation how small errors of poses travel: through products and inverses, into points and frames
"""
