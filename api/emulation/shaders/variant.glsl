// What a pipeline of Gaussians fixes of the kernel that projects, so that what it does not use costs nothing.

layout(constant_id = 0) const bool HAS_MATRIX = false;
layout(constant_id = 1) const bool HAS_FACTOR = false;
layout(constant_id = 2) const bool HARMONICS_IN_BUFFER = false;
// Every attribute is of 32-bit floats, as many as are wanted or more.
layout(constant_id = 3) const bool IS_FLOAT32 = false;
// Harmonics are of one vertex buffer, each as many bytes after the one before.
layout(constant_id = 4) const bool ARE_HARMONICS_EVEN = false;
layout(constant_id = 5) const bool HAS_CUT_TILES = false;
// Of the attributes.
layout(constant_id = 6) const uint DEGREE = 3u;
// Cameras may be fisheyes or panoramas.
layout(constant_id = 7) const bool HAS_ANGLES = false;
layout(constant_id = 8) const bool IS_UNSCENTED = false;
layout(constant_id = 9) const bool IS_SURFEL = false;
// Depths are tested, or a resolve shader reads them.
layout(constant_id = 10) const bool HAS_DEPTHS = false;
// Scales are logarithms; opacities are logits.
layout(constant_id = 11) const bool HAS_LOGARITHMS = false;
layout(constant_id = 12) const bool HAS_LOGITS = false;
// A resolve shader reads depths or Gaussians.
layout(constant_id = 13) const bool IS_RESOLVED = false;
// A camera has a lens that distorts.
layout(constant_id = 14) const bool HAS_LENS = false;
// Attributes are decoded from integers.
layout(constant_id = 15) const bool HAS_DECODINGS = false;
