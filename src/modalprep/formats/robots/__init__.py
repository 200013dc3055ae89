"""Robots: links and joints of URDF and MJCF files, as bodies and joints of a system, and back."""
