"""Where a tool, a sensor or a scanner sits, with covariance.

pivot       the tip of a tool that turns about a fixed point (Quirlen)
sphere      what a line scanner sees of a sphere
hand_eye    a scanner on a flange, from a sphere seen in many poses
planning    where to put the robot before anything is measured, and what it will tell
ax_xb       a sensor on a flange, from poses of both: A X = X B
literature  the methods of Kim and of Li, as the thesis cites them
motion      how the robot has to turn, and the refusal where it does not
robust      weights and scales that bad measurements cannot carry away
result      the one convention for what an estimator returns

calibrate   one call from one's own poses to a result with covariance, outliers and advice
own_data    what it fits, what disagrees, what to measure next; advice puts it in words
"""
