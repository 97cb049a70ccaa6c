"""Where a mobile robot is.

lateration  from distances to landmarks
odometry    by dead reckoning (Koppelnavigation)
wheels      car and Mecanum wheels: what they make of the body, and its step
ekf         with landmarks, by an extended Kalman filter
path        from one's own log: odometry and readings whenever they came
locate      the same from nothing: clocks mended, a global start, noise fitted
maps        grids, lines, points, graphs; rays through them
sensors     weightings: what a measurement says about each of many poses
particles   clouds of poses: motion, weights, resampling, estimates
mcl         Monte-Carlo localization: the filter itself, with recovery
drives      routes and drives to simulate
"""
