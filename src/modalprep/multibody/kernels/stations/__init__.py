"""Bodies with stations in the kernels: theory 4.10."""
