"""Tuned kernels. Each stands under the name of the readable function it equals; a test shows that they agree.

Use them where a figure drags ten thousand particles or a benchmark names a goal. To understand a method, read its
twin in `estimation`, `calibration` or `localization`.

rigid       rigid_rows: poses checked in few passes, their entries as rows
pivot       calibrate_pivot: tip and pivot from sums over the poses
hand_eye    calibrate_sphere_target: scanner and sphere from sums over the poses
ax_xb       calibrate_hand_eye: sensor and target from sums over the poses
cell        learned_pose, part_pose, flange_at_hole, miss_budget of one cell; Misses: of many simulated ones
kalman      filter_steps: the linear filter along a series
ekf         ekf_localize: the landmark filter along a drive, one robot or many
path        filter_path: a log with one step per reading, however many rows lie between
maps        cast_rays: rays through a map from thousands of poses; RangeTable: looked up
sensors     weigh_landmarks, weigh_beams, LikelihoodField, SensorSuite for thousands of particles
particles   sample_motion on one coordinate after the other, resample_systematic without a search
"""
