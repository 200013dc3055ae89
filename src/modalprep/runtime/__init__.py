"""The kernels without Python: LLVM code of all that one kind of system calls, libraries, and FMUs made of them."""
