//! The table of all mutants: each with the chapter of the conformance cases that it must fail, and what is wrong.

use crate::mutant::Mutant;

macro_rules! mutants {
    ($($chapter:literal: { $($name:ident = $text:literal,)* })*) => {
        $($(
            #[doc = $text]
            pub(crate) static $name: Mutant = Mutant { name: stringify!($name), chapter: $chapter, text: $text };
        )*)*

        /// All mutants.
        pub static MUTANTS: &[&Mutant] = &[$($(&$name),*),*];
    };
}

mutants! {
    "draws": {
        FIRST_VERTEX = "`vkCmdDraw` begins at vertex 0",
        LAST_VERTEX = "`vkCmdDraw` leaves the last vertex out",
        VERTICES_BEYOND_10000 = "`vkCmdDraw` draws no vertex beyond the 10,000th",
        INSTANCE_COUNT = "`vkCmdDraw` draws one instance",
        FIRST_INSTANCE = "`vkCmdDraw` begins at instance 0",
        ZERO_VERTICES = "`vkCmdDraw` of no vertices draws one",
        ZERO_INSTANCES = "`vkCmdDraw` of no instances draws one",
        FIRST_INDEX = "`vkCmdDrawIndexed` begins at index 0",
        VERTEX_OFFSET = "`vkCmdDrawIndexed` adds no vertex offset",
        INDEXED_INSTANCE_COUNT = "`vkCmdDrawIndexed` draws one instance",
        INDEXED_FIRST_INSTANCE = "`vkCmdDrawIndexed` begins at instance 0",
        INDICES_IGNORED = "`vkCmdDrawIndexed` draws the vertices in their order",
        INDEX_BUFFER_OFFSET = "The index buffer is read from its beginning",
        INDEX_BUFFER_REBOUND = "The index buffer is the one that was bound first",
        INDEX_TYPE = "Indices of 16 bits are read as 32",
        INDIRECT_DROPPED = "`vkCmdDrawIndirect` draws nothing",
        INDIRECT_OFFSET = "`vkCmdDrawIndirect` reads from the buffer's beginning",
        INDIRECT_STRIDE = "`vkCmdDrawIndirect` takes the parameters for packed",
        INDIRECT_FIRST_ONLY = "`vkCmdDrawIndirect` makes the first draw alone",
        INDEXED_INDIRECT_DROPPED = "`vkCmdDrawIndexedIndirect` draws nothing",
        INDEXED_INDIRECT_OFFSET = "`vkCmdDrawIndexedIndirect` reads from the buffer's beginning",
        INDEXED_INDIRECT_STRIDE = "`vkCmdDrawIndexedIndirect` takes the parameters for packed",
        INDEXED_INDIRECT_FIRST_ONLY = "`vkCmdDrawIndexedIndirect` makes the first draw alone",
        COUNT_DROPPED = "`vkCmdDrawIndirectCount` draws nothing",
        COUNT_IGNORED = "`vkCmdDrawIndirectCount` makes as many draws as it may",
        COUNT_MAXIMUM = "`vkCmdDrawIndirectCount` makes more draws than it may",
        COUNT_OFFSET = "`vkCmdDrawIndirectCount` takes its count from the buffer's beginning",
        COUNT_STRIDE = "`vkCmdDrawIndirectCount` takes the parameters for packed",
        INDEXED_COUNT_DROPPED = "`vkCmdDrawIndexedIndirectCount` draws nothing",
        INDEXED_COUNT_IGNORED = "`vkCmdDrawIndexedIndirectCount` makes as many draws as it may",
        INDEXED_COUNT_MAXIMUM = "`vkCmdDrawIndexedIndirectCount` makes more draws than it may",
        INDEXED_COUNT_OFFSET = "`vkCmdDrawIndexedIndirectCount` takes its count from the buffer's beginning",
        MULTI_FIRST_ONLY = "`vkCmdDrawMultiEXT` makes the first draw alone",
        MULTI_DROPPED = "`vkCmdDrawMultiEXT` draws nothing",
        MULTI_STRIDE = "`vkCmdDrawMultiEXT` takes the draws for packed",
        MULTI_FIRST_INSTANCE = "`vkCmdDrawMultiEXT` begins at instance 0",
        MULTI_INDEXED_FIRST_ONLY = "`vkCmdDrawMultiIndexedEXT` makes the first draw alone",
        MULTI_INDEXED_OFFSET = "`vkCmdDrawMultiIndexedEXT` takes offsets from the draws where there is one for all",
    }
    "sets": {
        SET_APART = "Each draw of a set is sorted alone",
        SETS_JOINED = "The sets of a pass are one set",
        SET_FIRST_BUFFERS = "A set is drawn from its first draw's vertex buffers",
        SET_LAST_BUFFERS = "A set is drawn from its last draw's vertex buffers",
        SET_FIRST_INDICES = "A set is drawn from its first draw's index buffer",
        SET_FIRST_DRAW_ONLY = "A set has its first draw alone",
        SET_LAST_DRAW_ONLY = "A set has its last draw alone",
        SET_EIGHT_DRAWS = "A set has no more than eight draws",
        SET_INDIRECT = "Indirect draws are not in a set",
        SET_INDEXED = "Indexed draws are not in a set",
        SET_REVERSED = "A set has its draws in the reverse order",
        SET_CLEARED = "What is cleared within a set is cleared after it",
        SET_EMPTY = "A set ends at a draw without Gaussians",
        SET_HARMONICS = "A set is drawn from its first draw's harmonics buffer",
        SET_DECODING_TABLES = "A set is decoded by its first draw's tables",
    }
    "vertex_input": {
        BUFFER_OFFSET = "Vertex buffers are read from their beginnings",
        BUFFER_REBOUND = "A vertex buffer is the one that was bound first",
        BUFFERS_FIRST_ONLY = "Of several vertex buffers, `vkCmdBindVertexBuffers` binds the first",
        BUFFERS_2_DROPPED = "`vkCmdBindVertexBuffers2` binds nothing",
        BUFFERS_2_OFFSET = "`vkCmdBindVertexBuffers2` binds buffers from their beginnings",
        BUFFERS_2_STRIDE = "`vkCmdBindVertexBuffers2` sets strides of 64 bytes",
        STRIDE = "Vertices are packed, whatever the stride",
        ATTRIBUTE_OFFSET = "Attributes have no offset within a vertex",
        RATE_VERTEX = "Attributes by instance advance by vertex",
        RATE_INSTANCE = "The opacity advances by instance",
        LOCATION_ORDER = "Attributes stand at locations in the order of the structure's members",
        LOCATION_SCALE = "The scale is read where the position is",
        LOCATION_ROTATION = "The rotation is read where the last attribute of four components is",
        UNORM8_IS_SNORM8 = "Normalised bytes are signed",
        SNORM8_IS_UNORM8 = "Normalised signed bytes are unsigned",
        UNORM16_IS_SNORM16 = "Normalised numbers of 16 bits are signed",
        SNORM16_IS_UNORM16 = "Normalised signed numbers of 16 bits are unsigned",
        FLOAT16_IS_UNORM16 = "Floats of 16 bits are normalised integers",
        BGRA8_IS_RGBA8 = "Bytes are red, green, blue in any case",
        PACKED_10_IS_SNORM = "Packed numbers of 10 bits are signed",
        SCALED_IS_NORMALISED = "Scaled integers are normalised",
    }
    "activation": {
        LOG_SCALE = "Logarithms of scales are scales",
        LOGIT_OPACITY = "Logits of opacities are opacities",
        BOTH_ACTIVATIONS = "Of two activations only the scale's is applied",
    }
    "harmonics_buffer": {
        HARMONICS_ADDRESS = "The harmonics begin 64 bytes before their address",
        HARMONICS_SIZE = "The harmonics end 64 bytes after their size",
        HARMONICS_SIZE_HALF = "The harmonics end in the middle of their buffer",
        HARMONICS_FORMAT = "Harmonics in a buffer are floats of 32 bits",
        HARMONICS_STRIDE = "A Gaussian has 48 bytes of harmonics, whatever the stride",
        HARMONICS_COEFFICIENT_STRIDE = "A coefficient has 12 bytes, whatever the stride",
        HARMONICS_REBOUND = "The harmonics buffer is the one that was bound first",
    }
    "decoding": {
        DECODING_SIGNED_LOG = "Decoded signed logarithms are positions",
        DECODING_BASE_COLOR = "Decoded colours are coefficients",
        DECODING_PALETTE = "Each Gaussian has the palette's entry of its own number",
        DECODING_ADDRESS = "Tables of positions begin 64 bytes before their address",
        DECODING_SIZE = "Tables of positions end 64 bytes after their size",
        DECODING_SIZE_PARTIAL = "Values that lie in a table in part are read",
        DECODING_STRIDE = "Bounds of chunks are packed, whatever their stride",
        DECODING_CHUNK_SIZE = "A chunk has 256 Gaussians, whatever its size",
        DECODING_CODES_SIZE = "The codes of harmonics have no end",
        DECODING_LABELS_SIZE = "Labels have no end",
        DECODING_CODES_STRIDE = "The codes of Gaussians are packed",
        DECODING_COEFFICIENT_STRIDE = "The codes of a coefficient follow those of the one before",
        DECODING_COMPONENT_STRIDE = "The codes of red, green and blue follow one another",
        DECODING_LABELS_STRIDE = "Labels are packed",
        DECODING_REBOUND = "The tables are those that were bound first",
    }
    "dynamic_state": {
        DYNAMIC_ORDER = "The dynamic order is the pipeline's",
        DYNAMIC_ANTIALIASING = "The dynamic antialiasing is the pipeline's",
        DYNAMIC_LOW_PASS_VARIANCE = "The dynamic low-pass variance is the pipeline's",
        DYNAMIC_ALPHA_FLOOR = "The dynamic alpha floor is the pipeline's",
        DYNAMIC_ALPHA_CEILING = "The dynamic alpha ceiling is the pipeline's",
        DYNAMIC_TRANSMITTANCE_FLOOR = "The dynamic transmittance floor is the pipeline's",
        DYNAMIC_DEGREE = "The dynamic degree of the harmonics is the pipeline's",
        DYNAMIC_EXPONENTIAL_ERROR = "The dynamic error of the exponential is the pipeline's",
        DYNAMIC_CONTRIBUTION_BUDGET = "The dynamic budget of contributions is the pipeline's",
        DYNAMIC_SET_ONCE = "The extension's dynamic states keep the first values that they are set to",
        DYNAMIC_VIEWPORT_COUNT = "`vkCmdSetViewportWithCount` sets a viewport outside the attachment",
        DYNAMIC_SCISSOR_COUNT = "`vkCmdSetScissorWithCount` sets a scissor of everything",
        DYNAMIC_DEPTH_TEST_ENABLE = "The dynamic enabling of the depth test is the pipeline's",
        DYNAMIC_DEPTH_WRITE_ENABLE = "The dynamic enabling of depth writes is the pipeline's",
        DYNAMIC_DEPTH_COMPARE_OP = "The dynamic depth comparison is the pipeline's",
        DYNAMIC_DEPTH_BOUNDS_ENABLE = "The dynamic enabling of depth bounds is the pipeline's",
        DYNAMIC_DEPTH_BOUNDS = "Dynamic depth bounds are the pipeline's",
        DYNAMIC_STENCIL_ENABLE = "The dynamic enabling of the stencil test is the pipeline's",
        DYNAMIC_STENCIL_OP = "Dynamic stencil operations are the pipeline's",
        DYNAMIC_STENCIL_COMPARE_MASK = "The dynamic compare mask is the pipeline's",
        DYNAMIC_STENCIL_WRITE_MASK = "The dynamic write mask of stencils is the pipeline's",
        DYNAMIC_STENCIL_REFERENCE = "The dynamic stencil reference is the pipeline's",
    }
    "views": {
        VIEWS_ONE_CAMERA = "All views see through the first of the cameras that a command sets",
        VIEWS_CAMERAS_PACKED = "A view's camera is chosen by its place among the views, not by its index",
        VIEWS_CAMERA_COUNT = "All views see through the first camera of a uniform buffer",
        VIEWS_DROPPED = "Nothing is drawn in a pass of several views",
        VIEWS_LAST_CAMERA = "All views see through the last of the cameras that a command sets",
    }
    "projection": {
        PROJECTED_DEPTH_KEY = "The depth key of a projecting shader is w",
        PROJECTED_COLOR = "Colour and covariance of a projecting shader are exchanged",
        PROJECTED_LOW_PASS = "What a shader projects is not low-passed",
        PROJECTED_PUSH_CONSTANTS = "Push constants of a projecting shader are those that were set first",
        VIEWPORT_FLIPPED = "A viewport of negative height is upright",
        PROJECTED_DESCRIPTORS = "Descriptor sets of a projecting shader are those that were bound first",
    }
    "state": {
        LOW_PASS_VARIANCE = "The low-pass variance is the default's",
        ALPHA_FLOOR = "The alpha floor is the default's",
        ALPHA_CEILING = "The alpha ceiling is the default's",
        TRANSMITTANCE_FLOOR = "The transmittance floor is the default's",
        ANTIALIASING = "Opacities are not compensated",
    }
    "order": {
        RADIAL_ORDER = "The order of radial distances is that of view depths",
        PRIMITIVE_ORDER = "The order of primitives is that of view depths",
        PER_PIXEL_ORDER = "The order of each pixel is that of view depths",
    }
    "surfel": {
        GEOMETRY = "2D Gaussians are 3D Gaussians",
    }
    "unscented": {
        LINEARIZATION = "The unscented transform is the Jacobian",
        SIGMA_ALPHA = "The sigma points' alpha is 1",
        SIGMA_BETA = "The sigma points' beta is 2",
        SIGMA_KAPPA = "The sigma points' kappa is 0",
        SIGMA_MARGIN = "Gaussians are drawn wherever their sigma points lie",
        SIGMA_ALL = "One sigma point in the picture is enough",
    }
    "harmonics": {
        DEGREE = "The harmonics' last degree is left out",
    }
    "binary16": {
        PRECISION = "Binary16 is binary32",
    }
    "approximation": {
        EXPONENTIAL_ERROR = "The exponential errs by a hundredth",
        CONTRIBUTION_BUDGET = "A tenth of each pixel may be left out",
    }
    "footprint": {
        CUT_OFF = "Nothing is cut off",
        CUT_OFF_RECTANGLE = "Tiles of a rectangle are tiles of a square",
        CUT_OFF_COMPENSATED = "The rectangle of the compensated opacity is the one of all deviations",
        CUT_OFF_DEVIATIONS = "Gaussians are cut off at three deviations",
        COMPENSATION_FLOOR = "The compensation of the opacity has no floor",
    }
    "instances": {
        MODEL_MATRIX = "Model matrices are the identity",
        MODEL_OPACITY = "Factors of the opacity are 1",
    }
    "camera": {
        CAMERA_EYE = "The camera's eye is mirrored in x",
        CAMERA_ORTHOGRAPHIC = "An orthographic camera is a pinhole",
        CAMERA_FISHEYE = "A fisheye is a pinhole",
        CAMERA_EQUIRECTANGULAR = "A panorama is a fisheye",
        CAMERA_ROTATION = "The camera's rotation is transposed",
        CAMERA_FOCAL_LENGTH = "Both focal lengths are that of x",
        CAMERA_PRINCIPAL_POINT = "Both coordinates of the principal point are that of x",
        CAMERA_NEAR_PLANE = "The near plane is at 0.2",
        CAMERA_FAR_PLANE = "The far plane is infinitely far",
        CAMERA_SET_ONCE = "The camera is the one that was set first",
        CAMERA_LOST = "A camera is lost when another pipeline is bound",
    }
    "distortion": {
        DISTORTION_IGNORED = "No lens distorts",
        DISTORTION_MODEL = "All lenses are rational",
        DISTORTION_FIRST = "A polynomial is not applied first",
        DISTORTION_RADIAL = "Radial coefficients are 0",
        DISTORTION_RADIAL_HIGH = "Radial coefficients from the third on are 0",
        DISTORTION_TANGENTIAL = "Tangential coefficients are 0",
        DISTORTION_TANGENTIAL_SWAPPED = "Tangential coefficients are swapped",
        DISTORTION_THIN_PRISM = "Coefficients of the thin prism are 0",
        DISTORTION_THIN_PRISM_ORDER = "Coefficients of the thin prism are those of u and v in turn",
        DISTORTION_OF_FIRST_VIEW = "All views see through the lens of the first",
    }
    "numerics": {
        CAMERA_EYE_BINARY32 = "The camera's eye is rounded to binary32",
    }
    "resolve": {
        RESOLVE_DEPTH = "Depth and linear depth of a resolve shader are exchanged",
        RESOLVE_GAUSSIANS = "The median and the nearest Gaussian are exchanged",
        RESOLVE_CONSTANTS = "Specialization constants of a resolve shader have their defaults",
        RESOLVE_PUSH_CONSTANTS = "Push constants of a resolve shader have no offset",
    }
    "depth": {
        DEPTH_COEFFICIENTS = "The camera's depth coefficients are 1 and -0.2",
        DEPTH_COMPARE = "Depths pass that are less",
        DEPTH_WRITE = "No depth is written",
        DEPTH_BOUNDS = "Depth bounds are not tested",
        VIEWPORT_DEPTHS = "The viewport's depths are 0 to 1",
    }
    "stencil": {
        STENCIL_PASS_OP = "Stencils that pass are kept",
        STENCIL_FAIL_OP = "Stencils that fail are kept",
        STENCIL_DEPTH_FAIL_OP = "Stencils whose depth fails are kept",
        STENCIL_COMPARE_OP = "Stencils always pass",
        STENCIL_COMPARE_MASK = "Stencils are compared whole",
        STENCIL_WRITE_MASK = "Stencils are written whole",
        STENCIL_REFERENCE = "The stencil reference is 0",
        STENCIL_BACK = "Gaussians face back",
    }
    "interactions": {
        VIEWPORT_ORIGIN = "The viewport begins at the attachment's corner",
        VIEWPORT_SET_ONCE = "The viewport is the one that was set first",
        SCISSOR_DROPPED = "There is no scissor",
        SCISSOR_ORIGIN = "The scissor begins at the attachment's corner",
        RENDER_AREA = "The render area begins at the attachment's corner",
        BLEND_ENABLE = "Fragments replace",
        BLEND_FACTORS = "Fragments are blended over",
        WRITE_MASK = "All components are written",
        SAMPLE_MASK = "All samples are written",
        RESOLVE_MODE = "Samples are resolved to the first",
    }
    "targets": {
        BLEND_OF_FIRST = "All attachments have the first's blending",
        WRITE_MASK_OF_FIRST = "All attachments have the first's write mask",
        BLEND_OP = "All fragments are added",
        BLEND_OF_ALPHA = "Alpha is blended as colours are",
        BLEND_CONSTANTS = "Blend constants are zeros",
        DYNAMIC_BLEND_CONSTANTS = "Dynamic blend constants are the pipeline's",
        ATTACHMENTS_FIRST_ONLY = "Only the first attachment is written",
    }
    "passes": {
        CLEAR_COLOR = "Attachments are cleared to zeros",
        LOAD_CLEARS = "Attachments that are loaded are cleared",
        CLEAR_LOADS = "Attachments that are cleared are loaded",
        PASS_OBJECT_CLEAR = "Render pass objects clear to zeros",
        SECOND_SUBPASS = "Nothing is drawn in the second subpass",
        SECONDARIES_DROPPED = "Secondary command buffers draw nothing",
        SECONDARIES_FIRST_ONLY = "Of several secondary command buffers the first draws",
        SECONDARIES_REVERSED = "Secondary command buffers run in the reverse order",
        RESUMED_DROPPED = "Nothing is drawn in resumed rendering",
        RESUMED_CLEARS = "Resumed rendering clears again",
        BASE_LAYER = "Attachments are their images' first layers",
    }
    "updates": {
        COPY_DROPPED = "`vkCmdCopyBuffer` copies nothing",
        COPY_LATE = "`vkCmdCopyBuffer` copies when the command buffer ends",
        UPDATE_DROPPED = "`vkCmdUpdateBuffer` writes nothing",
        UPDATE_LATE = "`vkCmdUpdateBuffer` writes when the command buffer ends",
        UPDATE_FIRST_ONLY = "The second `vkCmdUpdateBuffer` of a command buffer writes nothing",
        FILL_DROPPED = "`vkCmdFillBuffer` writes nothing",
        DISPATCH_DROPPED = "Dispatches write nothing",
        DISPATCH_LATE = "Dispatches write when the command buffer ends",
        HOST_LATE = "What the host writes between recording and submission is not seen",
        SUBMITTED_ONCE = "A command buffer runs once",
        SUBMIT_FIRST_BUFFER = "Of several command buffers of a submission the first runs",
        SUBMIT_FIRST_BATCH = "Of several batches of a submission the first runs",
    }
    "descriptors": {
        DYNAMIC_OFFSET = "Dynamic offsets are 0",
        DESCRIPTOR_OFFSET = "Descriptors of buffers begin where the buffers do",
        SET_REBOUND = "A descriptor set is the one that was bound first",
        DESCRIPTOR_WRITTEN_ONCE = "A descriptor is the one that was written first",
    }
    "queries": {
        OCCLUSION_BOOLEAN = "Precise occlusion queries say 1 where anything passes",
        OCCLUSION_ZERO = "Occlusion queries say that nothing passes",
        OCCLUSION_COPIED = "`vkCmdCopyQueryPoolResults` copies nothing",
        STATISTICS_ZERO = "Pipeline statistics are zeros",
        QUERIES_SUMMED = "A pool's queries have the sum of all",
    }
    "libraries": {
        LIBRARY_STATE = "The Gaussian state of a library is the default",
        LIBRARY_FOOTPRINT = "A library's footprint is forgotten",
        LIBRARY_BLEND = "A library's fragments replace",
    }
    "limits": {
        TILE_SIZE = "`tileSize` is 0 x 0",
        MAX_DEGREE = "`maxSphericalHarmonicsDegree` is 2",
        SAMPLE_COUNTS = "`gaussianSampleCounts` is four samples alone",
        MAX_PER_DRAW = "`maxGaussiansPerDraw` is 65,535",
        MAX_PER_SET = "`maxGaussiansPerSet` is less than `maxGaussiansPerDraw`",
        BASE_FEATURE = "Features are offered without `gaussianPrimitiveTopology`",
        INSTANCES_BEYOND_65535 = "No instance beyond the 65,535th is drawn",
        VERTICES_BEYOND_65535 = "No vertex beyond the 65,535th is drawn",
        PIXELS_BEYOND_2048 = "Nothing is drawn beyond 2,048 pixels",
    }
}
