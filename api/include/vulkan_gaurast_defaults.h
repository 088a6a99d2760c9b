/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Defaults and a camera for VK_GAURAST_gaussian_primitive_topology, in C and C++. Link with -lm. */

#ifndef VULKAN_GAURAST_DEFAULTS_H_
#define VULKAN_GAURAST_DEFAULTS_H_ 1

#include <math.h>
#include <string.h>

#include "vulkan_gaurast.h"

/* The state of 3DGS, without locations: all attributes, outputs and inputs are unused until they are set. */
static inline VkPipelineGaussianStateCreateInfoGAURAST vkGaussianStateDefaultsGAURAST(void) {
    VkPipelineGaussianStateCreateInfoGAURAST state;
    memset(&state, 0, sizeof state);
    state.sType = VK_STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST;
    memset(&state.attributeLocations, 0xFF, sizeof state.attributeLocations);
    memset(&state.vertexOutputLocations, 0xFF, sizeof state.vertexOutputLocations);
    memset(&state.resolveInputLocations, 0xFF, sizeof state.resolveInputLocations);
    state.lowPassVariance = 0.3f;
    state.alphaFloor = 1.0f / 255.0f;
    state.alphaCeiling = 0.99f;
    state.transmittanceFloor = 1e-4f;
    state.cameraCount = 1;
    return state;
}

/*
** A pinhole camera at `eye` that looks at `target`, for a viewport of `width` x `height` pixels.
**
** `up` is the direction that is up in the picture, in world space; it need not be a unit vector, but must not be parallel
** to the line of sight. `fieldOfView` is the vertical one, in radians. Depths are those of a projection with Vulkan's range,
** `nearPlane` and no far plane.
*/
static inline VkGaussianCameraGAURAST vkGaussianCameraLookAtGAURAST(const double eye[3], const double target[3],
    const double up[3], double fieldOfView, uint32_t width, uint32_t height, float nearPlane) {
    VkGaussianCameraGAURAST camera;
    double forward[3], right[3], down[3], length;
    int i;
    memset(&camera, 0, sizeof camera);
    camera.sType = VK_STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST;
    camera.model = VK_GAUSSIAN_CAMERA_MODEL_PINHOLE_GAURAST;
    for (i = 0; i < 3; i++) forward[i] = target[i] - eye[i];
    length = sqrt(forward[0] * forward[0] + forward[1] * forward[1] + forward[2] * forward[2]);
    for (i = 0; i < 3; i++) forward[i] /= length;
    for (i = 0; i < 3; i++) right[i] = forward[(i + 1) % 3] * up[(i + 2) % 3] - forward[(i + 2) % 3] * up[(i + 1) % 3];
    length = sqrt(right[0] * right[0] + right[1] * right[1] + right[2] * right[2]);
    for (i = 0; i < 3; i++) right[i] /= length;
    for (i = 0; i < 3; i++)
        down[i] = forward[(i + 1) % 3] * right[(i + 2) % 3] - forward[(i + 2) % 3] * right[(i + 1) % 3];
    for (i = 0; i < 3; i++) {
        camera.rotation[i] = (float)right[i];
        camera.rotation[3 + i] = (float)down[i];
        camera.rotation[6 + i] = (float)forward[i];
        camera.eye[i] = eye[i];
    }
    camera.focalLength[0] = camera.focalLength[1] = (float)(height / (2.0 * tan(fieldOfView / 2.0)));
    camera.principalPoint[0] = (float)width / 2.0f;
    camera.principalPoint[1] = (float)height / 2.0f;
    camera.nearPlane = nearPlane;
    camera.farPlane = HUGE_VALF;
    camera.depthCoefficients[0] = 1.0f;
    camera.depthCoefficients[1] = -nearPlane;
    return camera;
}

#endif
