/*
** The least that draws 3D Gaussians in C, through the Vulkan loader. It writes hello_gaussians.ppm, and objects go with
** the process. The same as examples/hello_gaussians.rs:
**
**     cc -std=c11 -I api/include samples/c/hello_gaussians.c -lvulkan -lm -o hello_gaussians
**     VK_DRIVER_FILES=driver/icd/gaurast_icd.json ./hello_gaussians   (after cargo build --release)
*/
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "vulkan_gaurast_defaults.h"

enum { SIZE = 256, FLOATS = 14, COUNT = 5 };
static const VkFormat FORMAT = VK_FORMAT_R8G8B8A8_UNORM;

/* Position, scale, rotation (w x y z), opacity, and the coefficient of the constant spherical harmonic. */
static const float GAUSSIANS[COUNT][FLOATS] = {
    {0.0f, 0.0f, 3.0f, 0.25f, 0.25f, 0.25f, 1.0f, 0.0f, 0.0f, 0.0f, 0.9f, 1.7f, 1.2f, -1.0f},
    {-0.7f, 0.0f, 3.2f, 0.10f, 0.45f, 0.10f, 1.0f, 0.0f, 0.0f, 0.2f, 0.8f, 1.7f, -1.4f, -1.2f},
    {0.7f, 0.0f, 3.2f, 0.10f, 0.45f, 0.10f, 1.0f, 0.0f, 0.0f, 0.2f, 0.8f, -1.5f, -0.6f, 1.7f},
    {0.0f, -0.7f, 3.2f, 0.45f, 0.10f, 0.10f, 1.0f, 0.0f, 0.0f, 0.2f, 0.8f, -1.2f, 1.5f, -0.8f},
    {0.0f, 0.7f, 3.2f, 0.45f, 0.10f, 0.10f, 1.0f, 0.0f, 0.0f, 0.2f, 0.8f, 0.9f, -1.2f, 1.6f},
};

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

/* A physical device that has the extension. */
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

/* Mapped memory for an object. */
static VkDeviceMemory allocate(VkMemoryRequirements needs, void** mapped) {
    const VkFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    VkPhysicalDeviceMemoryProperties types;
    vkGetPhysicalDeviceMemoryProperties(physical, &types);
    uint32_t index = 0;
    while (index < types.memoryTypeCount && (!(needs.memoryTypeBits >> index & 1) ||
           (types.memoryTypes[index].propertyFlags & wanted) != wanted))
        index++;
    VkMemoryAllocateInfo info = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, NULL, needs.size, index};
    VkDeviceMemory memory;
    CHECK(vkAllocateMemory(device, &info, NULL, &memory));
    CHECK(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, mapped));
    return memory;
}

static void create_device(void) {
    VkApplicationInfo app = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_3};
    VkInstanceCreateInfo instance_info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &app};
    VkInstance instance;
    CHECK(vkCreateInstance(&instance_info, NULL, &instance));
    physical = find_device(instance);
    VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST topology = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST,
        .gaussianPrimitiveTopology = VK_TRUE,
    };
    VkPhysicalDeviceVulkan13Features features = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES, .pNext = &topology, .dynamicRendering = VK_TRUE};
    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queue = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueCount = 1, .pQueuePriorities = &priority};
    const char* extension = VK_GAURAST_GAUSSIAN_PRIMITIVE_TOPOLOGY_EXTENSION_NAME;
    VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .pNext = &features,
        .queueCreateInfoCount = 1, .pQueueCreateInfos = &queue,
        .enabledExtensionCount = 1, .ppEnabledExtensionNames = &extension};
    CHECK(vkCreateDevice(physical, &info, NULL, &device));
}

/* A pipeline without shaders: it has the topology and the attributes of a Gaussian. */
static VkPipeline create_pipeline(void) {
    VkVertexInputBindingDescription binding = {0, FLOATS * sizeof(float), VK_VERTEX_INPUT_RATE_VERTEX};
    VkVertexInputAttributeDescription attributes[] = {
        {0, 0, VK_FORMAT_R32G32B32_SFLOAT, 0},
        {1, 0, VK_FORMAT_R32G32B32_SFLOAT, 3 * sizeof(float)},
        {2, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 6 * sizeof(float)},
        {3, 0, VK_FORMAT_R32_SFLOAT, 10 * sizeof(float)},
        {4, 0, VK_FORMAT_R32G32B32_SFLOAT, 11 * sizeof(float)},
    };
    VkPipelineGaussianStateCreateInfoGAURAST gaussian = vkGaussianStateDefaultsGAURAST();
    gaussian.attributeLocations = (VkGaussianAttributeLocationsGAURAST){
        0, 1, 2, 3, 4, VK_GAUSSIAN_LOCATION_UNUSED_GAURAST, VK_GAUSSIAN_LOCATION_UNUSED_GAURAST};
    VkPipelineRenderingCreateInfo rendering = {.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
        .pNext = &gaussian, .colorAttachmentCount = 1, .pColorAttachmentFormats = &FORMAT};
    VkPipelineVertexInputStateCreateInfo vertices = {.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
        .vertexBindingDescriptionCount = 1, .pVertexBindingDescriptions = &binding,
        .vertexAttributeDescriptionCount = 5, .pVertexAttributeDescriptions = attributes};
    VkPipelineInputAssemblyStateCreateInfo assembly = {.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
        .topology = VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST};
    VkViewport full = {0, 0, SIZE, SIZE, 0, 1};
    VkRect2D area = {{0, 0}, {SIZE, SIZE}};
    VkPipelineViewportStateCreateInfo viewport = {.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO,
        .viewportCount = 1, .pViewports = &full, .scissorCount = 1, .pScissors = &area};
    VkPipelineRasterizationStateCreateInfo raster = {
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO, .lineWidth = 1.0f};
    VkPipelineMultisampleStateCreateInfo samples = {.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
        .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
    VkPipelineColorBlendAttachmentState writes = {.colorWriteMask = 0xF};
    VkPipelineColorBlendStateCreateInfo blend = {.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
        .attachmentCount = 1, .pAttachments = &writes};
    VkPipelineLayoutCreateInfo layout_info = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    VkPipelineLayout layout;
    CHECK(vkCreatePipelineLayout(device, &layout_info, NULL, &layout));
    VkGraphicsPipelineCreateInfo info = {.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO, .pNext = &rendering,
        .pVertexInputState = &vertices, .pInputAssemblyState = &assembly, .pViewportState = &viewport,
        .pRasterizationState = &raster, .pMultisampleState = &samples, .pColorBlendState = &blend, .layout = layout};
    VkPipeline pipeline;
    CHECK(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &info, NULL, &pipeline));
    return pipeline;
}

/* A camera at the origin that looks along +z. At a distance of 1, its picture is 1 wide. */
static void set_camera(VkCommandBuffer commands) {
    const double eye[3] = {0, 0, 0}, ahead[3] = {0, 0, 1}, up[3] = {0, -1, 0};
    VkGaussianCameraGAURAST camera =
        vkGaussianCameraLookAtGAURAST(eye, ahead, up, 2.0 * atan(0.5), SIZE, SIZE, 0.2f);
    PFN_vkCmdSetGaussianCamerasGAURAST set =
        (PFN_vkCmdSetGaussianCamerasGAURAST)vkGetDeviceProcAddr(device, "vkCmdSetGaussianCamerasGAURAST");
    set(commands, 1, &camera);
}

int main(void) {
    create_device();
    void *mapped, *pixels;
    VkBuffer buffer;
    VkBufferCreateInfo buffer_info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = sizeof GAUSSIANS, .usage = VK_BUFFER_USAGE_VERTEX_BUFFER_BIT};
    CHECK(vkCreateBuffer(device, &buffer_info, NULL, &buffer));
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer, &needs);
    CHECK(vkBindBufferMemory(device, buffer, allocate(needs, &mapped), 0));
    memcpy(mapped, GAUSSIANS, sizeof GAUSSIANS);

    VkImage image;
    VkImageCreateInfo image_info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, .imageType = VK_IMAGE_TYPE_2D,
        .format = FORMAT, .extent = {SIZE, SIZE, 1}, .mipLevels = 1, .arrayLayers = 1,
        .samples = VK_SAMPLE_COUNT_1_BIT, .tiling = VK_IMAGE_TILING_LINEAR, .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT};
    CHECK(vkCreateImage(device, &image_info, NULL, &image));
    vkGetImageMemoryRequirements(device, image, &needs);
    CHECK(vkBindImageMemory(device, image, allocate(needs, &pixels), 0));
    VkImageSubresourceRange range = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageViewCreateInfo view_info = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, .image = image,
        .viewType = VK_IMAGE_VIEW_TYPE_2D, .format = FORMAT, .subresourceRange = range};
    VkImageView view;
    CHECK(vkCreateImageView(device, &view_info, NULL, &view));
    VkPipeline pipeline = create_pipeline();

    VkCommandPool pool;
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    CHECK(vkCreateCommandPool(device, &pool_info, NULL, &pool));
    VkCommandBuffer commands;
    VkCommandBufferAllocateInfo commands_info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, NULL, pool,
        VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    CHECK(vkAllocateCommandBuffers(device, &commands_info, &commands));
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    CHECK(vkBeginCommandBuffer(commands, &begin));
    VkImageMemoryBarrier to_general = {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
        .dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT, .newLayout = VK_IMAGE_LAYOUT_GENERAL,
        .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED, .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
        .image = image, .subresourceRange = range};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
        0, 0, NULL, 0, NULL, 1, &to_general);
    VkRenderingAttachmentInfo target = {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO, .imageView = view,
        .imageLayout = VK_IMAGE_LAYOUT_GENERAL, .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR, .storeOp = VK_ATTACHMENT_STORE_OP_STORE};
    VkRenderingInfo rendering = {.sType = VK_STRUCTURE_TYPE_RENDERING_INFO, .renderArea = {{0, 0}, {SIZE, SIZE}},
        .layerCount = 1, .colorAttachmentCount = 1, .pColorAttachments = &target};
    vkCmdBeginRendering(commands, &rendering);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
    vkCmdBindVertexBuffers(commands, 0, 1, &buffer, &(VkDeviceSize){0});
    set_camera(commands);
    vkCmdDraw(commands, COUNT, 1, 0, 0);
    vkCmdEndRendering(commands);
    VkMemoryBarrier to_host = {VK_STRUCTURE_TYPE_MEMORY_BARRIER, NULL, VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
        VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT, VK_PIPELINE_STAGE_HOST_BIT,
        0, 1, &to_host, 0, NULL, 0, NULL);
    CHECK(vkEndCommandBuffer(commands));
    VkQueue queue;
    vkGetDeviceQueue(device, 0, 0, &queue);
    VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands};
    CHECK(vkQueueSubmit(queue, 1, &submit, VK_NULL_HANDLE));
    CHECK(vkDeviceWaitIdle(device));

    /* Rows of a linear image may be padded. Without the premultiplied alpha, it is over black. */
    VkSubresourceLayout layout;
    vkGetImageSubresourceLayout(device, image, &(VkImageSubresource){VK_IMAGE_ASPECT_COLOR_BIT, 0, 0}, &layout);
    FILE* file = fopen("hello_gaussians.ppm", "wb");
    if (!file) {
        perror("hello_gaussians.ppm");
        return 1;
    }
    fprintf(file, "P6\n%d %d\n255\n", SIZE, SIZE);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            fwrite((const char*)pixels + layout.offset + y * layout.rowPitch + 4 * x, 1, 3, file);
    return fclose(file) == 0 ? 0 : 1;
}
