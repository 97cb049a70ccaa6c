"""Chapter 7: lateration and odometry."""
