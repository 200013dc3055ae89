"""From the records of a system to the kernels' arrays."""
