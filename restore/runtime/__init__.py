"""What the code runs on: checked arguments, compiled kernels, native libraries, threads."""
