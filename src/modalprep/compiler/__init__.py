"""How kernels are compiled: the one place that knows numba.

Kernels are written for `compile_kernel`, `compile_inline`, `compile_allocating`, `compile_once` and `by_address`, and
know nothing else. The switch says whether the private parts of numba are used, which make it faster.
"""
