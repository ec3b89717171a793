"""Bounds of what a sample may say, the same as the service's.

`proto/validity.json` holds samples at and beyond them, which the tests of this package and of the
service read.
"""

from __future__ import annotations

#: Largest coordinate, length, speed or standard deviation [m, m/s, rad].
METRES_MAX = 1e8
#: Largest angular rate [rad/s].
RADIANS_PER_SECOND_MAX = 1e3
#: Longest interval of one velocity sample [s].
DURATION_S_MAX = 3600.0
#: Farthest the norm of a quaternion or of a surface normal may be from one.
UNIT_TOLERANCE = 1e-3
#: Fewest and most numbers of a descriptor.
DESCRIPTOR_LEN_MIN, DESCRIPTOR_LEN_MAX = 8, 4096
#: Shortest descriptor that has a direction, by its norm.
DESCRIPTOR_NORM_MIN = 1e-12
#: Longest label of a landmark, marker or object [bytes of UTF-8].
LABEL_BYTES_MAX = 128
#: Finest and coarsest spacing of the places of an object [m].
SPACING_M_MIN, SPACING_M_MAX = 1e-5, 1e3
#: Largest standard deviation of what is felt [m, rad, unit of the channel].
TOUCH_SD_MAX = 1e6
#: Most rotations by which the frame of an episode may be turned against an object's.
ROTATIONS_MAX = 1000
#: Most samples of a batch, and of a question where they were taken.
BATCH_SAMPLES_MAX = 4096
#: Most contacts of a lesson about an object, and of a question which object it is.
LESSON_CONTACTS_MAX, IDENTIFY_CONTACTS_MAX = 4096, 256
