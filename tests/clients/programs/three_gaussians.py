"""A scene of three round Gaussians, and the check of its picture: python three_gaussians.py write|check FILE."""

import math
import struct
import sys

from PIL import Image

# Colours of Gaussians on a horizontal line, left to right in the world.
COLOURS = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
PLACES = [-1.2, 0.0, 1.2]
RADIUS = 0.15
OPACITY = 0.9
BAND_0 = 0.28209479177387814

if sys.argv[1] == "write":
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += ["scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    with open(sys.argv[2], "wb") as file:
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(PLACES)}"]
        header += [f"property float {name}" for name in names] + ["end_header"]
        file.write(("\n".join(header) + "\n").encode())
        for place, colour in zip(PLACES, COLOURS):
            values = [place, 0, 0] + [(part - 0.5) / BAND_0 for part in colour]
            values += [math.log(OPACITY / (1 - OPACITY))] + [math.log(RADIUS)] * 3 + [1, 0, 0, 0]
            file.write(struct.pack(f"<{len(values)}f", *values))
    sys.exit()

picture = Image.open(sys.argv[2]).convert("RGB")
size = picture.width
# The camera is 4 away and sees 60 degrees. PLY files of Gaussians have y down, and the camera looks along z, so that
# the world's x may be mirrored: the picture says which way.
focal = size / 2 / math.tan(math.radians(30))
sigma = focal * RADIUS / 4
columns = [size / 2 + focal * place / 4 for place in PLACES]
left = picture.getpixel((int(columns[0]), size // 2))
order = COLOURS if left[0] > left[2] else COLOURS[::-1]
worst = 0
for column, colour in zip(columns, order):
    for distance in (0.0, 0.7, 1.3, 2.0):
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            x, y = int(column + dx * distance * sigma), int(size / 2 + dy * distance * sigma)
            # Its reference adds 0.3 to the covariance in pixels.
            square = ((x + 0.5 - column) ** 2 + (y + 0.5 - size / 2) ** 2) / (sigma**2 + 0.3)
            alpha = OPACITY * math.exp(-0.5 * square)
            found = picture.getpixel((x, y))
            for channel in range(3):
                worst = max(worst, abs(found[channel] - 255 * alpha * colour[channel]))
if worst > 6:
    sys.exit(print(f"a pixel is off by {worst:.1f} of 255") or 1)
print(f"48 pixels of three Gaussians within {worst:.1f} of 255 of their formula")
