"""The one array type of everything that computes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
