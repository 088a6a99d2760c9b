//! The mistakes that were tried with revision 1 of the extension, before there was a layer.

/// A mistake by its name, and what the driver of revision 1 said of it.
pub const BEFORE: &[(&str, &str)] = &[
    (
        "the extension is enabled without a structure of features",
        "that the feature is not enabled; the hint at the Khronos layer stood in another message",
    ),
    (
        "an optional feature without `gaussianPrimitiveTopology`",
        "nothing, until a pipeline was created",
    ),
    (
        "features without the extension",
        "that the extension is missing",
    ),
    (
        "the topology without a Gaussian state",
        "that it must be chained",
    ),
    (
        "a Gaussian state beside a list of triangles",
        "nothing of it",
    ),
    ("primitive restart", "the rule"),
    ("a vertex stage with fixed-function projection", "both"),
    ("vertex-shader projection without a vertex stage", "both"),
    ("an order that is none", "the value"),
    (
        "a degree of harmonics that the device does not have",
        "the value and the limit",
    ),
    ("an alpha floor of 1 in 255ths", "the value and the limits"),
    (
        "an alpha ceiling below the floor",
        "the value and the limits",
    ),
    ("culling of back faces", "nothing"),
    ("a polygon mode of lines", "nothing"),
    (
        "rasterizer discard",
        "that it is not supported, and no rule",
    ),
    ("blending that multiplies by alpha once more", "nothing"),
    ("an integer colour attachment", "nothing"),
    ("no attribute of the rotation", "the location"),
    (
        "the opacity's location is unused",
        "\"location 4294967295\"",
    ),
    (
        "fewer coefficients than the degree needs",
        "the coefficient and its location",
    ),
    ("positions of integers", "that the format does not convert"),
    ("position and scale at one location", "nothing"),
    (
        "the structure of locations is zeroed",
        "that `firstModelMatrix` is used",
    ),
    (
        "a model opacity of 0, which is a location",
        "nothing: opacities were multiplied by x",
    ),
    (
        "a resolve shader that reads where nothing is",
        "the component and the location",
    ),
    (
        "a resolve shader whose inputs are exchanged",
        "the component and the location",
    ),
    ("a resolve shader that writes the depth", "the rule"),
    (
        "`RADIAL_DISTANCE` without its feature",
        "the mode and the feature",
    ),
    (
        "`PER_PIXEL` without its feature",
        "the mode and the feature",
    ),
    (
        "2D Gaussians without their feature",
        "the mode and the feature",
    ),
    ("a fisheye without its feature", "the mode and the feature"),
    ("the structure's type was not set", "nothing"),
    ("a rotation that is NaN", "the member and the rule, twice"),
    ("no focal length", "the member and the rule, twice"),
    (
        "a far plane before the near one",
        "the member and the rule, twice",
    ),
    (
        "a far plane of 0 for none",
        "the member and the rule, twice",
    ),
    ("a rotation with a scale", "nothing"),
    ("a draw without a camera", "that the draw draws nothing"),
    ("more Gaussians than the buffer holds", "nothing"),
    ("a first vertex in floats", "nothing"),
    ("more indices than the buffer holds", "nothing"),
    ("an index of no Gaussian", "nothing"),
    ("a second draw that replaces the first", "nothing"),
    ("logarithms for scales", "nothing"),
    ("logits for opacities", "nothing"),
    ("rotations of zeros", "nothing"),
    ("rotations as x, y, z, w", "nothing"),
    ("a position that is NaN", "nothing"),
    ("a camera that looks along -z", "nothing"),
    (
        "no set with the camera's uniform buffer",
        "that the draw draws nothing",
    ),
    (
        "a camera in a uniform buffer whose far plane is 0",
        "that the draw draws nothing",
    ),
];
