"""One thread for every library: to be imported before any of them.

Numerical libraries read these variables once, when they are loaded. A peer with more threads than
`cogmap-lab bench recall`, which has one, would be another comparison.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
