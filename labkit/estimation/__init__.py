"""Least squares and filters.

optimization  Newton, Gauss-Newton, Levenberg-Marquardt, trust region, with the trace of every iterate
differences   Jacobians by finite differences
gaussian      regions of normal distributions
kalman        the linear Kalman filter, its steady state, and the checks of its honesty
"""
