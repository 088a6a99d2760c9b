/*
** Gaussians among triangles, in C, through the Vulkan loader: a mesh with depth, two sorted sets, a resolve shader that
** adds fog by depth and tells which Gaussian a pixel shows, an indirect count that a compute shader writes, and two frames
** in flight by a timeline semaphore. It draws FRAMES frames, writes the last one to gaussian_scene.ppm, and prints what is
** under some pixels:
**
**     cc -std=c11 -I api/include samples/c/gaussian_scene.c -lvulkan -lm -o gaussian_scene
**     VK_DRIVER_FILES=driver/icd/gaurast_icd.json ./gaussian_scene samples/c/shaders   (after cargo build --release)
*/
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "vulkan_gaurast_defaults.h"

enum {
    WIDTH = 320, HEIGHT = 240, FRAMES = 5, IN_FLIGHT = 2,
    FLOATS = 14,                 /* Position, scale, rotation (w x y z), opacity, constant harmonic. */
    CLUSTERS = 12, CLUSTER = 60, /* A spiral of bushes, of which those outside the picture are not drawn. */
    BALL = 400, TUFT = 80,
    SPIRAL = CLUSTERS * CLUSTER, GAUSSIANS = SPIRAL + BALL + TUFT,
    FIRST_DRAW = 16              /* Bytes before the first indirect draw: the count, and padding. */
};
static const VkFormat COLOR = VK_FORMAT_R8G8B8A8_UNORM, PICK = VK_FORMAT_R32_UINT, DEPTH = VK_FORMAT_D32_SFLOAT;
static const float FOG[4] = {0.62f, 0.68f, 0.75f, 0.09f}; /* Colour and density. */

#define CHECK(call)                                                        \
    do {                                                                   \
        VkResult result = (call);                                          \
        if (result != VK_SUCCESS) {                                        \
            fprintf(stderr, "%s returned %d\n", #call, (int)result);       \
            exit(1);                                                       \
        }                                                                  \
    } while (0)

static VkPhysicalDevice physical;
static VkDevice device;
static VkQueue queue;
static PFN_vkCmdSetGaussianCamerasGAURAST set_cameras;
static PFN_vkCmdBeginGaussianSetGAURAST begin_set;
static PFN_vkCmdEndGaussianSetGAURAST end_set;

/* A buffer that stays mapped. */
typedef struct Buffer {
    VkBuffer handle;
    VkDeviceMemory memory;
    void* mapped;
} Buffer;

typedef struct Image {
    VkImage handle;
    VkImageView view;
    VkDeviceMemory memory;
} Image;

/* All that one frame in flight has for itself. */
typedef struct Frame {
    VkCommandPool pool;
    VkCommandBuffer commands;
    VkDescriptorSet set;
    Buffer draws;           /* The count and the indirect draws. */
    Image color, pick, depth;
    Buffer colors, picks;   /* What is read back. */
} Frame;

static Frame frames[IN_FLIGHT];
static Buffer gaussians, triangles, indices, clusters;
static VkDescriptorSetLayout set_layout;
static VkPipelineLayout draw_layout, cull_layout;
static VkPipeline mesh_pipeline, gaussian_pipeline, cull_pipeline;

/* ---- The scene ---- */

static uint32_t seed = 1;

/* A number from -1 to 1. */
static float number(void) {
    seed = seed * 1664525u + 1013904223u;
    return (float)(seed >> 8) / 8388608.0f - 1.0f;
}

/* A Gaussian near a place, of a colour from 0 to 1. */
static void add(float* at, const float middle[3], float spread, float size, const float color[3]) {
    for (int i = 0; i < 3; i++) {
        at[i] = middle[i] + spread * number();
        at[3 + i] = size * (1.0f + 0.5f * number());
        at[11 + i] = (color[i] * (1.0f + 0.25f * number()) - 0.5f) / 0.28209479f;
    }
    for (int i = 0; i < 4; i++)
        at[6 + i] = number();
    at[10] = 0.75f;
}

/* +x is right, +y is down, and +z is forward. */
static void fill_gaussians(float (*to)[FLOATS], float (*of_clusters)[4]) {
    for (int cluster = 0; cluster < CLUSTERS; cluster++) {
        const float angle = 2.4f * (float)cluster + 0.6f, away = 0.9f + 0.45f * (float)cluster;
        const float middle[3] = {away * cosf(angle), 0.2f, 5.0f + away * sinf(angle)};
        const float color[3] = {0.5f + 0.4f * cosf(angle), 0.45f, 0.5f + 0.4f * sinf(angle)};
        for (int i = 0; i < CLUSTER; i++)
            add(to[cluster * CLUSTER + i], middle, 0.3f, 0.06f, color);
        memcpy(of_clusters[cluster], middle, sizeof middle);
        of_clusters[cluster][3] = 0.75f;
    }
    const float ball[3] = {0.0f, -0.15f, 5.0f}, orange[3] = {0.95f, 0.55f, 0.15f};
    for (int i = 0; i < BALL; i++) {
        float* at = to[SPIRAL + i];
        add(at, ball, 0.6f, 0.06f, orange);
        const float away[3] = {at[0] - ball[0], at[1] - ball[1], at[2] - ball[2]};
        const float length = sqrtf(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]) + 1e-3f;
        for (int k = 0; k < 3; k++)
            at[k] = ball[k] + 0.6f * away[k] / length;
    }
    const float tuft[3] = {-1.1f, 0.55f, 2.6f}, green[3] = {0.25f, 0.6f, 0.2f};
    for (int i = 0; i < TUFT; i++)
        add(to[SPIRAL + BALL + i], tuft, 0.22f, 0.03f, green);
}

typedef struct Vertex {
    float position[3], color[3];
} Vertex;

enum { VERTICES = 4 + 8, INDICES = 6 + 36 };

/* A floor, and a box that stands in the ball. */
static void fill_mesh(Vertex* vertices, uint16_t* to) {
    const float floor_y = 0.8f;
    for (int i = 0; i < 4; i++)
        vertices[i] = (Vertex){{i & 1 ? 4.0f : -4.0f, floor_y, i & 2 ? 10.0f : 1.5f}, {0.35f, 0.33f, 0.30f}};
    for (int i = 0; i < 8; i++) {
        const float x = i & 1 ? 0.35f : -0.35f, y = i & 2 ? floor_y : -1.0f, z = i & 4 ? 5.35f : 4.65f;
        const float light = i & 2 ? 0.5f : 0.9f;
        vertices[4 + i] = (Vertex){{x, y, z}, {0.45f * light, 0.6f * light, 0.9f * light}};
    }
    static const uint16_t QUADS[7][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {8, 9, 10, 11}, {4, 6, 8, 10}, {5, 7, 9, 11},
        {4, 5, 8, 9}, {6, 7, 10, 11}};
    for (int quad = 0; quad < 7; quad++) {
        static const int CORNERS[6] = {0, 1, 2, 2, 1, 3};
        for (int i = 0; i < 6; i++)
            to[6 * quad + i] = QUADS[quad][CORNERS[i]];
    }
}

/* The projection matrix, by columns, that takes triangles to where a pinhole camera takes Gaussians, depths included. */
static void projection_of(const VkGaussianCameraGAURAST* camera, float to[16]) {
    const double scale[2] = {2.0 * camera->focalLength[0] / WIDTH, 2.0 * camera->focalLength[1] / HEIGHT};
    const double shift[2] = {2.0 * camera->principalPoint[0] / WIDTH - 1.0, 2.0 * camera->principalPoint[1] / HEIGHT - 1.0};
    for (int column = 0; column < 4; column++) {
        double axes[3]; /* The column of (R | -R e). */
        for (int row = 0; row < 3; row++) {
            const float* r = &camera->rotation[3 * row];
            axes[row] = column < 3 ? r[column] : -(r[0] * camera->eye[0] + r[1] * camera->eye[1] + r[2] * camera->eye[2]);
        }
        to[4 * column + 0] = (float)(scale[0] * axes[0] + shift[0] * axes[2]);
        to[4 * column + 1] = (float)(scale[1] * axes[1] + shift[1] * axes[2]);
        to[4 * column + 2] = (float)(camera->depthCoefficients[0] * axes[2] +
                                     (column == 3 ? camera->depthCoefficients[1] : 0.0));
        to[4 * column + 3] = (float)axes[2];
    }
}

/* ---- Objects ---- */

static VkPhysicalDevice find_device(VkInstance instance) {
    VkPhysicalDevice devices[16];
    uint32_t count = 16;
    vkEnumeratePhysicalDevices(instance, &count, devices);
    for (uint32_t i = 0; i < count; i++) {
        static VkExtensionProperties extensions[1024];
        uint32_t names = 1024;
        vkEnumerateDeviceExtensionProperties(devices[i], NULL, &names, extensions);
        for (uint32_t k = 0; k < names; k++)
            if (!strcmp(extensions[k].extensionName, VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_EXTENSION_NAME))
                return devices[i];
    }
    fprintf(stderr, "no device has " VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_EXTENSION_NAME "; set VK_DRIVER_FILES\n");
    exit(1);
}

static VkInstance create_device(void) {
    VkApplicationInfo app = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_3};
    VkInstanceCreateInfo instance_info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &app};
    VkInstance instance;
    CHECK(vkCreateInstance(&instance_info, NULL, &instance));
    physical = find_device(instance);
    VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST topology = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST,
        .gaussianPrimitiveTopology = VK_TRUE, .resolveFragmentShader = VK_TRUE, .mergedDraws = VK_TRUE,
        .gaussianDepthStencil = VK_TRUE, .resolveGaussianIndices = VK_TRUE};
    VkPhysicalDeviceVulkan13Features of_13 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
        .pNext = &topology, .dynamicRendering = VK_TRUE, .synchronization2 = VK_TRUE,
        .maintenance4 = VK_TRUE};  /* Workgroup sizes in SPIR-V of Vulkan 1.3. */
    VkPhysicalDeviceVulkan12Features of_12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .pNext = &of_13, .drawIndirectCount = VK_TRUE, .timelineSemaphore = VK_TRUE};
    VkPhysicalDeviceFeatures2 features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &of_12,
        .features = {.independentBlend = VK_TRUE, .multiDrawIndirect = VK_TRUE}};
    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queue_info = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueCount = 1, .pQueuePriorities = &priority};
    const char* extension = VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_EXTENSION_NAME;
    VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .pNext = &features,
        .queueCreateInfoCount = 1, .pQueueCreateInfos = &queue_info,
        .enabledExtensionCount = 1, .ppEnabledExtensionNames = &extension};
    CHECK(vkCreateDevice(physical, &info, NULL, &device));
    vkGetDeviceQueue(device, 0, 0, &queue);
    set_cameras = (PFN_vkCmdSetGaussianCamerasGAURAST)vkGetDeviceProcAddr(device, "vkCmdSetGaussianCamerasGAURAST");
    begin_set = (PFN_vkCmdBeginGaussianSetGAURAST)vkGetDeviceProcAddr(device, "vkCmdBeginGaussianSetGAURAST");
    end_set = (PFN_vkCmdEndGaussianSetGAURAST)vkGetDeviceProcAddr(device, "vkCmdEndGaussianSetGAURAST");
    return instance;
}

static VkDeviceMemory allocate(VkMemoryRequirements needs, VkFlags wanted) {
    VkPhysicalDeviceMemoryProperties types;
    vkGetPhysicalDeviceMemoryProperties(physical, &types);
    uint32_t index = 0;
    while (index < types.memoryTypeCount && (!(needs.memoryTypeBits >> index & 1) ||
           (types.memoryTypes[index].propertyFlags & wanted) != wanted))
        index++;
    VkMemoryAllocateInfo info = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, NULL, needs.size, index};
    VkDeviceMemory memory;
    CHECK(vkAllocateMemory(device, &info, NULL, &memory));
    return memory;
}

static Buffer create_buffer(VkDeviceSize size, VkBufferUsageFlags usage) {
    Buffer buffer;
    VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = usage};
    CHECK(vkCreateBuffer(device, &info, NULL, &buffer.handle));
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer.handle, &needs);
    buffer.memory = allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    CHECK(vkBindBufferMemory(device, buffer.handle, buffer.memory, 0));
    CHECK(vkMapMemory(device, buffer.memory, 0, VK_WHOLE_SIZE, 0, &buffer.mapped));
    return buffer;
}

static VkImageSubresourceRange range_of(VkFormat format) {
    const VkImageAspectFlags aspect = format == DEPTH ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
    return (VkImageSubresourceRange){aspect, 0, 1, 0, 1};
}

static Image create_image(VkFormat format) {
    Image image;
    const VkImageUsageFlags usage = format == DEPTH
        ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT
        : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, .imageType = VK_IMAGE_TYPE_2D,
        .format = format, .extent = {WIDTH, HEIGHT, 1}, .mipLevels = 1, .arrayLayers = 1,
        .samples = VK_SAMPLE_COUNT_1_BIT, .usage = usage};
    CHECK(vkCreateImage(device, &info, NULL, &image.handle));
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, image.handle, &needs);
    image.memory = allocate(needs, 0);
    CHECK(vkBindImageMemory(device, image.handle, image.memory, 0));
    VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, .image = image.handle,
        .viewType = VK_IMAGE_VIEW_TYPE_2D, .format = format, .subresourceRange = range_of(format)};
    CHECK(vkCreateImageView(device, &view, NULL, &image.view));
    return image;
}

static VkShaderModule load_shader(const char* folder, const char* name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.spv", folder, name);
    FILE* file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(1);
    }
    static uint32_t words[16384];
    VkShaderModuleCreateInfo info = {.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
        .codeSize = fread(words, 1, sizeof words, file), .pCode = words};
    fclose(file);
    VkShaderModule module;
    CHECK(vkCreateShaderModule(device, &info, NULL, &module));
    return module;
}

static void create_layouts(void) {
    VkDescriptorSetLayoutBinding bindings[2] = {
        {.binding = 0, .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .descriptorCount = 1,
            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT},
        {.binding = 1, .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .descriptorCount = 1,
            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT}};
    VkDescriptorSetLayoutCreateInfo set_info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = 2, .pBindings = bindings};
    CHECK(vkCreateDescriptorSetLayout(device, &set_info, NULL, &set_layout));
    /* The projection matrix, and fog or numbers: both pipelines that draw read one range, which is pushed once. */
    VkPushConstantRange push = {VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0, 80};
    VkPipelineLayoutCreateInfo info = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
        .pushConstantRangeCount = 1, .pPushConstantRanges = &push};
    CHECK(vkCreatePipelineLayout(device, &info, NULL, &draw_layout));
    push = (VkPushConstantRange){VK_SHADER_STAGE_COMPUTE_BIT, 0, 72};
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    CHECK(vkCreatePipelineLayout(device, &info, NULL, &cull_layout));
}

static VkPipelineShaderStageCreateInfo stage_of(VkShaderStageFlagBits stage, VkShaderModule module) {
    return (VkPipelineShaderStageCreateInfo){.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
        .stage = stage, .module = module, .pName = "main"};
}

/* What the two pipelines that draw have in common, and what they do not. */
static VkPipeline create_pipeline(const VkPipelineGaussianStateCreateInfoGAURAST* gaussian, uint32_t stage_count,
    const VkPipelineShaderStageCreateInfo* stages, const VkPipelineVertexInputStateCreateInfo* vertices) {
    const VkFormat formats[2] = {COLOR, PICK};
    VkPipelineRenderingCreateInfo rendering = {.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
        .pNext = gaussian, .colorAttachmentCount = 2, .pColorAttachmentFormats = formats,
        .depthAttachmentFormat = DEPTH};
    VkPipelineInputAssemblyStateCreateInfo assembly = {.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
        .topology = gaussian ? VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST : VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST};
    VkViewport full = {0, 0, WIDTH, HEIGHT, 0, 1};
    VkRect2D area = {{0, 0}, {WIDTH, HEIGHT}};
    VkPipelineViewportStateCreateInfo viewport = {.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO,
        .viewportCount = 1, .pViewports = &full, .scissorCount = 1, .pScissors = &area};
    VkPipelineRasterizationStateCreateInfo raster = {
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO, .lineWidth = 1.0f};
    VkPipelineMultisampleStateCreateInfo samples = {.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
        .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
    /* Gaussians are tested against the mesh, and are blended: what is behind them shows. */
    VkPipelineDepthStencilStateCreateInfo depth = {.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO,
        .depthTestEnable = VK_TRUE, .depthWriteEnable = gaussian == NULL, .depthCompareOp = VK_COMPARE_OP_LESS};
    VkPipelineColorBlendAttachmentState targets[2] = {
        {.blendEnable = gaussian != NULL, .srcColorBlendFactor = VK_BLEND_FACTOR_ONE,
            .dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA, .srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
            .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA, .colorWriteMask = 0xF},
        {.colorWriteMask = VK_COLOR_COMPONENT_R_BIT}};
    VkPipelineColorBlendStateCreateInfo blend = {.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
        .attachmentCount = 2, .pAttachments = targets};
    VkGraphicsPipelineCreateInfo info = {.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO, .pNext = &rendering,
        .stageCount = stage_count, .pStages = stages, .pVertexInputState = vertices, .pInputAssemblyState = &assembly,
        .pViewportState = &viewport, .pRasterizationState = &raster, .pMultisampleState = &samples,
        .pDepthStencilState = &depth, .pColorBlendState = &blend, .layout = draw_layout};
    VkPipeline pipeline;
    CHECK(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &info, NULL, &pipeline));
    return pipeline;
}

static void create_pipelines(const char* folder) {
    const VkShaderModule modules[4] = {load_shader(folder, "mesh.vert"), load_shader(folder, "mesh.frag"),
        load_shader(folder, "resolve.frag"), load_shader(folder, "cull.comp")};
    VkPipelineShaderStageCreateInfo of_mesh[2] = {
        stage_of(VK_SHADER_STAGE_VERTEX_BIT, modules[0]), stage_of(VK_SHADER_STAGE_FRAGMENT_BIT, modules[1])};
    VkVertexInputBindingDescription by_vertex = {0, sizeof(Vertex), VK_VERTEX_INPUT_RATE_VERTEX};
    VkVertexInputAttributeDescription attributes[5] = {
        {0, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(Vertex, position)},
        {1, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(Vertex, color)}};
    VkPipelineVertexInputStateCreateInfo vertices = {.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
        .vertexBindingDescriptionCount = 1, .pVertexBindingDescriptions = &by_vertex,
        .vertexAttributeDescriptionCount = 2, .pVertexAttributeDescriptions = attributes};
    mesh_pipeline = create_pipeline(NULL, 2, of_mesh, &vertices);

    by_vertex.stride = FLOATS * sizeof(float);
    static const uint32_t OFFSETS[5] = {0, 3, 6, 10, 11};
    static const VkFormat FORMATS[5] = {VK_FORMAT_R32G32B32_SFLOAT, VK_FORMAT_R32G32B32_SFLOAT,
        VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R32_SFLOAT, VK_FORMAT_R32G32B32_SFLOAT};
    for (uint32_t i = 0; i < 5; i++)
        attributes[i] = (VkVertexInputAttributeDescription){i, 0, FORMATS[i], OFFSETS[i] * sizeof(float)};
    vertices.vertexAttributeDescriptionCount = 5;
    VkPipelineGaussianStateCreateInfoGAURAST gaussian = vkGaussianStateDefaultsGAURAST();
    gaussian.attributeLocations = (VkGaussianAttributeLocationsGAURAST){
        0, 1, 2, 3, 4, VK_GAUSSIAN_LOCATION_UNUSED_GAURAST, VK_GAUSSIAN_LOCATION_UNUSED_GAURAST};
    gaussian.resolveInputLocations.accumulatedColor = 0;
    gaussian.resolveInputLocations.linearDepth = 1;
    gaussian.resolveInputLocations.medianGaussian = 2;
    VkPipelineShaderStageCreateInfo resolve = stage_of(VK_SHADER_STAGE_FRAGMENT_BIT, modules[2]);
    gaussian_pipeline = create_pipeline(&gaussian, 1, &resolve, &vertices);

    VkComputePipelineCreateInfo cull = {.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = stage_of(VK_SHADER_STAGE_COMPUTE_BIT, modules[3]), .layout = cull_layout};
    CHECK(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &cull, NULL, &cull_pipeline));
    for (int i = 0; i < 4; i++)
        vkDestroyShaderModule(device, modules[i], NULL);
}

static void create_frame(Frame* frame, VkDescriptorPool pool) {
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    CHECK(vkCreateCommandPool(device, &pool_info, NULL, &frame->pool));
    VkCommandBufferAllocateInfo commands = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, NULL, frame->pool,
        VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    CHECK(vkAllocateCommandBuffers(device, &commands, &frame->commands));
    const VkDeviceSize size = FIRST_DRAW + CLUSTERS * sizeof(VkDrawIndirectCommand);
    frame->draws = create_buffer(size, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
        VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    frame->color = create_image(COLOR);
    frame->pick = create_image(PICK);
    frame->depth = create_image(DEPTH);
    frame->colors = create_buffer(4 * WIDTH * HEIGHT, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    frame->picks = create_buffer(4 * WIDTH * HEIGHT, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    VkDescriptorSetAllocateInfo set = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, .descriptorPool = pool,
        .descriptorSetCount = 1, .pSetLayouts = &set_layout};
    CHECK(vkAllocateDescriptorSets(device, &set, &frame->set));
    VkDescriptorBufferInfo buffers[2] = {
        {frame->draws.handle, 0, VK_WHOLE_SIZE}, {clusters.handle, 0, VK_WHOLE_SIZE}};
    VkWriteDescriptorSet write = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, .dstSet = frame->set,
        .descriptorCount = 2, .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .pBufferInfo = buffers};
    vkUpdateDescriptorSets(device, 1, &write, 0, NULL);
}

/* ---- A frame ---- */

static void memory_barrier(VkCommandBuffer commands, VkPipelineStageFlags2 from, VkAccessFlags2 written,
    VkPipelineStageFlags2 to, VkAccessFlags2 used) {
    VkMemoryBarrier2 barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER_2, NULL, from, written, to, used};
    VkDependencyInfo info = {.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1,
        .pMemoryBarriers = &barrier};
    vkCmdPipelineBarrier2(commands, &info);
}

static VkImageMemoryBarrier2 image_barrier(VkImage image, VkFormat format, VkPipelineStageFlags2 from,
    VkAccessFlags2 written, VkImageLayout before, VkPipelineStageFlags2 to, VkAccessFlags2 used, VkImageLayout after) {
    return (VkImageMemoryBarrier2){VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2, NULL, from, written, to, used, before,
        after, VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, image, range_of(format)};
}

static void image_barriers(VkCommandBuffer commands, uint32_t count, const VkImageMemoryBarrier2* barriers) {
    VkDependencyInfo info = {.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .imageMemoryBarrierCount = count,
        .pImageMemoryBarriers = barriers};
    vkCmdPipelineBarrier2(commands, &info);
}

/* Writes the indirect draws of the clusters that may be in the picture, and their number. */
static void cull(const Frame* frame, const float projection[16]) {
    const VkCommandBuffer commands = frame->commands;
    vkCmdFillBuffer(commands, frame->draws.handle, 0, VK_WHOLE_SIZE, 0);
    memory_barrier(commands, VK_PIPELINE_STAGE_2_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
        VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT);
    const uint32_t numbers[2] = {CLUSTERS, CLUSTER};
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, cull_pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, cull_layout, 0, 1, &frame->set, 0, NULL);
    vkCmdPushConstants(commands, cull_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, 64, projection);
    vkCmdPushConstants(commands, cull_layout, VK_SHADER_STAGE_COMPUTE_BIT, 64, sizeof numbers, numbers);
    vkCmdDispatch(commands, 1, 1, 1);
    /* What a draw reads must be written before the render pass begins. */
    memory_barrier(commands, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT,
        VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT);
}

static void draw(const Frame* frame, const VkGaussianCameraGAURAST* camera, const float projection[16]) {
    const VkCommandBuffer commands = frame->commands;
    const VkShaderStageFlags stages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
    vkCmdPushConstants(commands, draw_layout, stages, 0, 64, projection);
    vkCmdPushConstants(commands, draw_layout, stages, 64, sizeof FOG, FOG);
    const VkDeviceSize start = 0;
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, mesh_pipeline);
    vkCmdBindVertexBuffers(commands, 0, 1, &triangles.handle, &start);
    vkCmdBindIndexBuffer(commands, indices.handle, 0, VK_INDEX_TYPE_UINT16);
    vkCmdDrawIndexed(commands, INDICES, 1, 0, 0, 0);

    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, gaussian_pipeline);
    vkCmdBindVertexBuffers(commands, 0, 1, &gaussians.handle, &start);
    set_cameras(commands, 1, camera);
    /* The spiral goes through the ball: they are sorted together. */
    begin_set(commands);
    vkCmdDrawIndirectCount(commands, frame->draws.handle, FIRST_DRAW, frame->draws.handle, 0, CLUSTERS,
        sizeof(VkDrawIndirectCommand));
    vkCmdDraw(commands, BALL, 1, SPIRAL, 0);
    end_set(commands);
    /* The tuft is before all of them: another set, which is blended over the first. */
    begin_set(commands);
    vkCmdDraw(commands, TUFT, 1, SPIRAL + BALL, 0);
    end_set(commands);
}

static void record(Frame* frame, const VkGaussianCameraGAURAST* camera) {
    const VkCommandBuffer commands = frame->commands;
    float projection[16];
    projection_of(camera, projection);
    CHECK(vkResetCommandPool(device, frame->pool, 0));
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
        .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    CHECK(vkBeginCommandBuffer(commands, &begin));
    cull(frame, projection);

    const VkPipelineStageFlags2 output = VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT;
    const VkAccessFlags2 outputs = VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT;
    const VkPipelineStageFlags2 tests =
        VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT;
    const VkAccessFlags2 depths =
        VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
    const VkImageMemoryBarrier2 before[3] = {
        image_barrier(frame->color.handle, COLOR, output, 0, VK_IMAGE_LAYOUT_UNDEFINED, output, outputs,
            VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL),
        image_barrier(frame->pick.handle, PICK, output, 0, VK_IMAGE_LAYOUT_UNDEFINED, output, outputs,
            VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL),
        image_barrier(frame->depth.handle, DEPTH, tests, 0, VK_IMAGE_LAYOUT_UNDEFINED, tests, depths,
            VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL)};
    image_barriers(commands, 3, before);

    VkRenderingAttachmentInfo targets[2] = {
        {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO, .imageView = frame->color.view,
            .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
            .storeOp = VK_ATTACHMENT_STORE_OP_STORE, .clearValue = {.color = {.float32 = {FOG[0], FOG[1], FOG[2], 1.0f}}}},
        {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO, .imageView = frame->pick.view,
            .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
            .storeOp = VK_ATTACHMENT_STORE_OP_STORE}};
    VkRenderingAttachmentInfo depth = {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
        .imageView = frame->depth.view, .imageLayout = VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL,
        .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR, .storeOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
        .clearValue = {.depthStencil = {1.0f, 0}}};
    VkRenderingInfo rendering = {.sType = VK_STRUCTURE_TYPE_RENDERING_INFO, .renderArea = {{0, 0}, {WIDTH, HEIGHT}},
        .layerCount = 1, .colorAttachmentCount = 2, .pColorAttachments = targets, .pDepthAttachment = &depth};
    vkCmdBeginRendering(commands, &rendering);
    draw(frame, camera, projection);
    vkCmdEndRendering(commands);

    const VkPipelineStageFlags2 copy = VK_PIPELINE_STAGE_2_COPY_BIT;
    const VkImageMemoryBarrier2 after[2] = {
        image_barrier(frame->color.handle, COLOR, output, outputs, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, copy,
            VK_ACCESS_2_TRANSFER_READ_BIT, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL),
        image_barrier(frame->pick.handle, PICK, output, outputs, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, copy,
            VK_ACCESS_2_TRANSFER_READ_BIT, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL)};
    image_barriers(commands, 2, after);
    VkBufferImageCopy whole = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, .imageExtent = {WIDTH, HEIGHT, 1}};
    vkCmdCopyImageToBuffer(commands, frame->color.handle, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, frame->colors.handle, 1,
        &whole);
    vkCmdCopyImageToBuffer(commands, frame->pick.handle, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, frame->picks.handle, 1,
        &whole);
    memory_barrier(commands, copy, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
    CHECK(vkEndCommandBuffer(commands));
}

static void wait_for(VkSemaphore timeline, uint64_t value) {
    VkSemaphoreWaitInfo info = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, .semaphoreCount = 1,
        .pSemaphores = &timeline, .pValues = &value};
    CHECK(vkWaitSemaphores(device, &info, UINT64_MAX));
}

/* The camera of a frame: it goes around. */
static VkGaussianCameraGAURAST camera_of(int frame) {
    const double angle = 0.08 * (frame - FRAMES / 2);
    const double eye[3] = {5.2 * sin(angle), -0.9, 5.0 - 5.2 * cos(angle)}, target[3] = {0, -0.05, 5}, up[3] = {0, -1, 0};
    return vkGaussianCameraLookAtGAURAST(eye, target, up, 0.85, WIDTH, HEIGHT, 0.2f);
}

static void tell(const Frame* frame, int x, int y) {
    const uint32_t picked = ((const uint32_t*)frame->picks.mapped)[y * WIDTH + x];
    const char* part = picked > SPIRAL + BALL ? "the tuft" : picked > SPIRAL ? "the ball" : "the spiral";
    if (picked)
        printf("(%d, %d): Gaussian %u, of %s\n", x, y, picked - 1, part);
    else
        printf("(%d, %d): no Gaussian\n", x, y);
}

static int write_picture(const Frame* frame) {
    FILE* file = fopen("gaussian_scene.ppm", "wb");
    if (!file) {
        perror("gaussian_scene.ppm");
        return 1;
    }
    fprintf(file, "P6\n%d %d\n255\n", WIDTH, HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        fwrite((const char*)frame->colors.mapped + 4 * i, 1, 3, file);
    return fclose(file) == 0 ? 0 : 1;
}

static void destroy_buffer(Buffer buffer) {
    vkDestroyBuffer(device, buffer.handle, NULL);
    vkFreeMemory(device, buffer.memory, NULL);
}

static void destroy_image(Image image) {
    vkDestroyImageView(device, image.view, NULL);
    vkDestroyImage(device, image.handle, NULL);
    vkFreeMemory(device, image.memory, NULL);
}

int main(int count, char** arguments) {
    const VkInstance instance = create_device();
    create_layouts();
    create_pipelines(count > 1 ? arguments[1] : "samples/c/shaders");
    gaussians = create_buffer(GAUSSIANS * FLOATS * sizeof(float), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT);
    clusters = create_buffer(CLUSTERS * 4 * sizeof(float), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    triangles = create_buffer(VERTICES * sizeof(Vertex), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT);
    indices = create_buffer(INDICES * sizeof(uint16_t), VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
    fill_gaussians(gaussians.mapped, clusters.mapped);
    fill_mesh(triangles.mapped, indices.mapped);

    VkDescriptorPoolSize size = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * IN_FLIGHT};
    VkDescriptorPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
        .maxSets = IN_FLIGHT, .poolSizeCount = 1, .pPoolSizes = &size};
    VkDescriptorPool pool;
    CHECK(vkCreateDescriptorPool(device, &pool_info, NULL, &pool));
    for (int i = 0; i < IN_FLIGHT; i++)
        create_frame(&frames[i], pool);
    VkSemaphoreTypeCreateInfo type = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
        .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
    VkSemaphoreCreateInfo semaphore_info = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &type};
    VkSemaphore timeline;
    CHECK(vkCreateSemaphore(device, &semaphore_info, NULL, &timeline));

    for (int number = 0; number < FRAMES; number++) {
        Frame* frame = &frames[number % IN_FLIGHT];
        /* Frame n signals n + 1. What this frame uses was last used by frame n - IN_FLIGHT. */
        if (number >= IN_FLIGHT)
            wait_for(timeline, (uint64_t)(number - IN_FLIGHT + 1));
        const VkGaussianCameraGAURAST camera = camera_of(number);
        record(frame, &camera);
        VkCommandBufferSubmitInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
            .commandBuffer = frame->commands};
        VkSemaphoreSubmitInfo signal = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO, .semaphore = timeline,
            .value = (uint64_t)number + 1, .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
        VkSubmitInfo2 submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2, .commandBufferInfoCount = 1,
            .pCommandBufferInfos = &commands, .signalSemaphoreInfoCount = 1, .pSignalSemaphoreInfos = &signal};
        CHECK(vkQueueSubmit2(queue, 1, &submit, VK_NULL_HANDLE));
    }
    wait_for(timeline, FRAMES);
    const Frame* last = &frames[(FRAMES - 1) % IN_FLIGHT];
    printf("%u of %d clusters\n", *(const uint32_t*)last->draws.mapped, CLUSTERS);
    tell(last, WIDTH / 2, HEIGHT / 2);
    tell(last, 40, HEIGHT - 30);
    tell(last, 4, 4);
    const int failed = write_picture(last);

    CHECK(vkDeviceWaitIdle(device));
    for (int i = 0; i < IN_FLIGHT; i++) {
        Frame* frame = &frames[i];
        vkDestroyCommandPool(device, frame->pool, NULL);
        destroy_buffer(frame->draws);
        destroy_buffer(frame->colors);
        destroy_buffer(frame->picks);
        destroy_image(frame->color);
        destroy_image(frame->pick);
        destroy_image(frame->depth);
    }
    vkDestroySemaphore(device, timeline, NULL);
    vkDestroyDescriptorPool(device, pool, NULL);
    vkDestroyPipeline(device, mesh_pipeline, NULL);
    vkDestroyPipeline(device, gaussian_pipeline, NULL);
    vkDestroyPipeline(device, cull_pipeline, NULL);
    vkDestroyPipelineLayout(device, draw_layout, NULL);
    vkDestroyPipelineLayout(device, cull_layout, NULL);
    vkDestroyDescriptorSetLayout(device, set_layout, NULL);
    destroy_buffer(gaussians);
    destroy_buffer(clusters);
    destroy_buffer(triangles);
    destroy_buffer(indices);
    vkDestroyDevice(device, NULL);
    vkDestroyInstance(instance, NULL);
    return failed;
}
