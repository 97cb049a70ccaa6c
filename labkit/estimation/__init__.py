"""Least squares and filters.

optimization  Newton, Gauss-Newton, Levenberg-Marquardt, trust region, with the trace of every iterate
convexity     where a function is convex
differences   Jacobians by finite differences
influence     what single measurements do to a fit: outliers, leaving one out
clocks        streams on two clocks: poses between samples, the offset of the clocks
gaussian      regions of normal distributions
kalman        the linear Kalman filter, its steady state, and the checks of its honesty
"""
