"""Files of other people: poses, points and logs in the formats robots, trackers and cameras write.

text     lines and columns of a text file: separators, decimal commas, comments, headers, line numbers
columns  what a column means, from its title, and in which unit
poses    poses in any of the usual notations, with what was assumed about them
points   measured points
systems  the lab sheet's files: systems of three points, swirled frames, a tool
bags     ROS recordings, where the optional package rosbags is installed
logs     odometry, landmarks, readings and true poses of a drive
samples  the synthetic cells of data/own_data, each with a planted fault

Every refusal is one sentence with file and line.
"""
