#ifndef VULKAN_GAURAST_H_
#define VULKAN_GAURAST_H_ 1

/*
** VK_GAURAST_gaussian_primitive_topology, revision 1: a 3D Gaussian is a primitive.
**
** Include after <vulkan/vulkan.h>, or let this file do it. C11 and C++17. The meaning of every name is in
** spec/VK_GAURAST_gaussian_primitive_topology.adoc; the extension is not registered with Khronos.
**
** SPDX-License-Identifier: MIT OR Apache-2.0
*/

#include <vulkan/vulkan.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VK_GAURAST_gaussian_primitive_topology 1
#define VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_SPEC_VERSION 1
#define VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_EXTENSION_NAME "VK_GAURAST_gaussian_primitive_topology"

/* A location that a pipeline does not use. */
#define VK_GAUSSIAN_LOCATION_UNUSED_GAURAST (~0U)

/* Values that the extension adds to core enums; block 1000997000 + n, extension number 998. */
#define VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST ((VkPrimitiveTopology)1000997000)
#define VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST ((VkStructureType)1000997000)
#define VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES_GAURAST ((VkStructureType)1000997001)
#define VK_STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST ((VkStructureType)1000997002)
#define VK_STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST ((VkStructureType)1000997003)
#define VK_STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO_GAURAST ((VkStructureType)1000997004)

typedef enum VkGaussianProjectionModeGAURAST {
    VK_GAUSSIAN_PROJECTION_MODE_FIXED_FUNCTION_GAURAST = 0,
    VK_GAUSSIAN_PROJECTION_MODE_VERTEX_SHADER_GAURAST = 1,
    VK_GAUSSIAN_PROJECTION_MODE_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianProjectionModeGAURAST;

typedef enum VkGaussianGeometryGAURAST {
    VK_GAUSSIAN_GEOMETRY_GAUSSIAN_3D_GAURAST = 0,
    VK_GAUSSIAN_GEOMETRY_GAUSSIAN_2D_GAURAST = 1,
    VK_GAUSSIAN_GEOMETRY_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianGeometryGAURAST;

typedef enum VkGaussianLinearizationGAURAST {
    VK_GAUSSIAN_LINEARIZATION_JACOBIAN_GAURAST = 0,
    VK_GAUSSIAN_LINEARIZATION_UNSCENTED_GAURAST = 1,
    VK_GAUSSIAN_LINEARIZATION_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianLinearizationGAURAST;

typedef enum VkGaussianOrderGAURAST {
    VK_GAUSSIAN_ORDER_VIEW_DEPTH_GAURAST = 0,
    VK_GAUSSIAN_ORDER_RADIAL_DISTANCE_GAURAST = 1,
    VK_GAUSSIAN_ORDER_PRIMITIVE_GAURAST = 2,
    VK_GAUSSIAN_ORDER_PER_PIXEL_GAURAST = 3,
    VK_GAUSSIAN_ORDER_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianOrderGAURAST;

typedef enum VkGaussianPrecisionGAURAST {
    VK_GAUSSIAN_PRECISION_FLOAT32_GAURAST = 0,
    VK_GAUSSIAN_PRECISION_FLOAT16_GAURAST = 1,
    VK_GAUSSIAN_PRECISION_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianPrecisionGAURAST;

typedef enum VkGaussianAntialiasingGAURAST {
    VK_GAUSSIAN_ANTIALIASING_DILATE_GAURAST = 0,
    VK_GAUSSIAN_ANTIALIASING_OPACITY_COMPENSATED_GAURAST = 1,
    VK_GAUSSIAN_ANTIALIASING_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianAntialiasingGAURAST;

typedef enum VkGaussianCameraSourceGAURAST {
    VK_GAUSSIAN_CAMERA_SOURCE_COMMAND_GAURAST = 0,
    VK_GAUSSIAN_CAMERA_SOURCE_UNIFORM_BUFFER_GAURAST = 1,
    VK_GAUSSIAN_CAMERA_SOURCE_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianCameraSourceGAURAST;

typedef enum VkGaussianCameraModelGAURAST {
    VK_GAUSSIAN_CAMERA_MODEL_PINHOLE_GAURAST = 0,
    VK_GAUSSIAN_CAMERA_MODEL_ORTHOGRAPHIC_GAURAST = 1,
    VK_GAUSSIAN_CAMERA_MODEL_FISHEYE_GAURAST = 2,
    VK_GAUSSIAN_CAMERA_MODEL_EQUIRECTANGULAR_GAURAST = 3,
    VK_GAUSSIAN_CAMERA_MODEL_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkGaussianCameraModelGAURAST;

typedef enum VkPipelineGaussianStateCreateFlagBitsGAURAST {
    VK_PIPELINE_GAUSSIAN_STATE_CREATE_MERGE_DRAWS_BIT_GAURAST = 0x00000001,
    VK_PIPELINE_GAUSSIAN_STATE_CREATE_FLAG_BITS_MAX_ENUM_GAURAST = 0x7FFFFFFF
} VkPipelineGaussianStateCreateFlagBitsGAURAST;
typedef VkFlags VkPipelineGaussianStateCreateFlagsGAURAST;

typedef struct VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST {
    VkStructureType    sType;
    void*              pNext;
    VkBool32           gaussianPrimitiveTopology;
    VkBool32           vertexShaderProjection;
    VkBool32           resolveFragmentShader;
    VkBool32           radialDistanceOrder;
    VkBool32           primitiveOrder;
    VkBool32           perPixelOrder;
    VkBool32           rasterizationFloat16;
    VkBool32           opacityCompensation;
    VkBool32           orthographicCamera;
    VkBool32           fisheyeCamera;
    VkBool32           equirectangularCamera;
    VkBool32           unscentedProjection;
    VkBool32           gaussian2D;
    VkBool32           uniformBufferCamera;
    VkBool32           mergedDraws;
    VkBool32           gaussianInstancing;
    VkBool32           gaussianDepthStencil;
    VkBool32           gaussianMultisample;
    VkBool32           gaussianApproximation;
} VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;

typedef struct VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST {
    VkStructureType       sType;
    void*                 pNext;
    VkExtent2D            tileSize;
    uint32_t              rasterizerModuleCount;
    uint32_t              processingElementCount;
    uint32_t              maxSphericalHarmonicsDegree;
    VkSampleCountFlags    gaussianSampleCounts;
    uint64_t              maxGaussiansPerDraw;
    uint64_t              maxGaussiansPerSet;
} VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST;

typedef struct VkGaussianAttributeLocationsGAURAST {
    uint32_t    position;
    uint32_t    scale;
    uint32_t    rotation;
    uint32_t    opacity;
    uint32_t    firstSphericalHarmonics;
    uint32_t    firstModelMatrix;
    uint32_t    modelOpacity;
} VkGaussianAttributeLocationsGAURAST;

typedef struct VkGaussianVertexOutputLocationsGAURAST {
    uint32_t    covariance;
    uint32_t    opacity;
    uint32_t    color;
    uint32_t    depthKey;
} VkGaussianVertexOutputLocationsGAURAST;

typedef struct VkGaussianResolveInputLocationsGAURAST {
    uint32_t    accumulatedColor;
    uint32_t    depth;
} VkGaussianResolveInputLocationsGAURAST;

typedef struct VkPipelineGaussianStateCreateInfoGAURAST {
    VkStructureType                              sType;
    const void*                                  pNext;
    VkPipelineGaussianStateCreateFlagsGAURAST    flags;
    VkGaussianProjectionModeGAURAST              projectionMode;
    VkGaussianGeometryGAURAST                    geometry;
    VkGaussianLinearizationGAURAST               linearization;
    uint32_t                                     sphericalHarmonicsDegree;
    VkGaussianAttributeLocationsGAURAST          attributeLocations;
    VkGaussianVertexOutputLocationsGAURAST       vertexOutputLocations;
    VkGaussianResolveInputLocationsGAURAST       resolveInputLocations;
    VkGaussianOrderGAURAST                       order;
    VkGaussianPrecisionGAURAST                   precision;
    VkGaussianAntialiasingGAURAST                antialiasing;
    float                                        lowPassVariance;
    float                                        alphaFloor;
    float                                        alphaCeiling;
    float                                        transmittanceFloor;
    VkGaussianCameraSourceGAURAST                cameraSource;
    uint32_t                                     cameraSet;
    uint32_t                                     cameraBinding;
} VkPipelineGaussianStateCreateInfoGAURAST;

typedef struct VkPipelineGaussianApproximationStateCreateInfoGAURAST {
    VkStructureType    sType;
    const void*        pNext;
    float              exponentialError;
    float              contributionBudget;
} VkPipelineGaussianApproximationStateCreateInfoGAURAST;

typedef struct VkGaussianCameraGAURAST {
    VkStructureType                 sType;
    const void*                     pNext;
    VkGaussianCameraModelGAURAST    model;
    float                           rotation[9];
    double                          eye[3];
    float                           focalLength[2];
    float                           principalPoint[2];
    float                           nearPlane;
    float                           farPlane;
    float                           depthCoefficients[2];
} VkGaussianCameraGAURAST;

/* The camera as a uniform buffer holds it: 112 bytes, the std140 layout of the block in the specification. */
typedef struct VkGaussianCameraDataGAURAST {
    double                          eye[3];
    VkGaussianCameraModelGAURAST    model;
    uint32_t                        reserved;
    float                           rotation[3][4];
    float                           focalLength[2];
    float                           principalPoint[2];
    float                           depthCoefficients[2];
    float                           nearPlane;
    float                           farPlane;
} VkGaussianCameraDataGAURAST;

typedef void (VKAPI_PTR *PFN_vkCmdSetGaussianCameraGAURAST)(VkCommandBuffer commandBuffer, const VkGaussianCameraGAURAST* pCamera);

#ifndef VK_NO_PROTOTYPES
/* Not exported by the loader: get it with vkGetDeviceProcAddr. */
VKAPI_ATTR void VKAPI_CALL vkCmdSetGaussianCameraGAURAST(
    VkCommandBuffer                             commandBuffer,
    const VkGaussianCameraGAURAST*              pCamera);
#endif

#ifdef __cplusplus
}
#endif

#endif
