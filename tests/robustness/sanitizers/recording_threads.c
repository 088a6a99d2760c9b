/*
** Eight threads record and submit to two queues, and read what other threads' submissions wrote: after the wait for a fence,
** for a timeline semaphore, or for a queue. All is synchronized as Vulkan requires, so that a sanitizer has nothing to say.
**
** With the argument `race`, each thread also writes a word that another one reads without synchronization: a race of the
** program, which ThreadSanitizer has to find.
*/
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

enum { THREADS = 8, QUEUES = 2, ROUNDS = 20, WORDS = 1024 };

#define CHECK(call)                                                        \
    do {                                                                   \
        VkResult result = (call);                                          \
        if (result != VK_SUCCESS) {                                        \
            fprintf(stderr, "%s returned %d\n", #call, (int)result);       \
            exit(2);                                                       \
        }                                                                  \
    } while (0)

static VkDevice device;
static uint32_t memory_type;
static VkQueue queues[QUEUES];
/* Vulkan asks the program to use a queue from one thread at a time. */
static pthread_mutex_t queue_locks[QUEUES] = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_MUTEX_INITIALIZER};
static int races;

/* A thread's objects. Its semaphore counts the rounds that its submissions have done. */
typedef struct {
    int number;
    VkCommandPool pool;
    VkBuffer source, target;
    uint32_t *written, *read;
    VkSemaphore done, seen;
    VkFence fence;
    /* Written before a submission, and read by another thread after the wait for it. */
    uint64_t round;
    /* Written and read without synchronization, if the program is to race. */
    uint32_t shared;
} Worker;
static Worker workers[THREADS];

static VkBuffer buffer(uint32_t** mapped) {
    VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = 4 * WORDS,
        .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    VkMemoryAllocateInfo allocation = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .memoryTypeIndex = memory_type};
    VkMemoryRequirements needs;
    VkDeviceMemory memory;
    VkBuffer made;
    CHECK(vkCreateBuffer(device, &info, NULL, &made));
    vkGetBufferMemoryRequirements(device, made, &needs);
    allocation.allocationSize = needs.size;
    CHECK(vkAllocateMemory(device, &allocation, NULL, &memory));
    CHECK(vkBindBufferMemory(device, made, memory, 0));
    CHECK(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, (void**)mapped));
    return made;
}

static VkSemaphore timeline(void) {
    VkSemaphoreTypeCreateInfo type = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
        .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
    VkSemaphoreCreateInfo info = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &type};
    VkSemaphore made;
    CHECK(vkCreateSemaphore(device, &info, NULL, &made));
    return made;
}

static void wait_for(VkSemaphore semaphore, uint64_t value) {
    VkSemaphoreWaitInfo info = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, .semaphoreCount = 1,
        .pSemaphores = &semaphore, .pValues = &value};
    CHECK(vkWaitSemaphores(device, &info, UINT64_MAX));
}

/* Copies the source to the target, and counts the round. */
static void submit(Worker* self, uint64_t round) {
    VkCommandBufferAllocateInfo allocation = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = self->pool, .commandBufferCount = 1};
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    VkBufferCopy half = {.size = 2 * WORDS};
    VkBufferCopy rest = {.srcOffset = 2 * WORDS, .dstOffset = 2 * WORDS, .size = 2 * WORDS};
    VkCommandBuffer commands;
    CHECK(vkAllocateCommandBuffers(device, &allocation, &commands));
    CHECK(vkBeginCommandBuffer(commands, &begin));
    vkCmdCopyBuffer(commands, self->source, self->target, 1, &half);
    vkCmdCopyBuffer(commands, self->source, self->target, 1, &rest);
    CHECK(vkEndCommandBuffer(commands));
    VkTimelineSemaphoreSubmitInfo values = {.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO,
        .signalSemaphoreValueCount = 1, .pSignalSemaphoreValues = &round};
    VkSubmitInfo info = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .pNext = &values, .commandBufferCount = 1,
        .pCommandBuffers = &commands, .signalSemaphoreCount = 1, .pSignalSemaphores = &self->done};
    pthread_mutex_t* lock = &queue_locks[self->number % QUEUES];
    pthread_mutex_lock(lock);
    CHECK(vkQueueSubmit(queues[self->number % QUEUES], 1, &info, self->fence));
    pthread_mutex_unlock(lock);
}

static void expect(const uint32_t* words, uint32_t value) {
    for (int i = 0; i < WORDS; i++)
        if (words[i] != value) {
            fprintf(stderr, "word %d is %u, not %u\n", i, words[i], value);
            exit(2);
        }
}

static void* run(void* argument) {
    Worker* self = argument;
    Worker* next = &workers[(self->number + 1) % THREADS];
    for (uint64_t round = 1; round <= ROUNDS; round++) {
        /* The thread before this one has read what this one wrote in the round before. */
        wait_for(self->seen, round - 1);
        for (int i = 0; i < WORDS; i++) self->written[i] = (uint32_t)(100 * round) + (uint32_t)self->number;
        self->round = round;
        submit(self, round);
        if (races) self->shared++;
        /* The other thread's words, by its semaphore. */
        wait_for(next->done, round);
        expect(next->read, (uint32_t)(100 * round) + (uint32_t)next->number);
        if (next->round != round) exit(2);
        if (races && next->shared == 1000) puts("never");
        VkSemaphoreSignalInfo seen = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO, .semaphore = next->seen,
            .value = round};
        CHECK(vkSignalSemaphore(device, &seen));
        /* This thread's own, by its fence. */
        CHECK(vkWaitForFences(device, 1, &self->fence, VK_TRUE, UINT64_MAX));
        CHECK(vkResetFences(device, 1, &self->fence));
        expect(self->read, (uint32_t)(100 * round) + (uint32_t)self->number);
        CHECK(vkResetCommandPool(device, self->pool, 0));
    }
    return NULL;
}

int main(int count, char** arguments) {
    races = count > 1 && !strcmp(arguments[1], "race");
    VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_2};
    VkInstanceCreateInfo instance_info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
        .pApplicationInfo = &application};
    VkInstance instance;
    CHECK(vkCreateInstance(&instance_info, NULL, &instance));
    VkPhysicalDevice physical;
    uint32_t one = 1;
    CHECK(vkEnumeratePhysicalDevices(instance, &one, &physical));
    VkQueueFamilyProperties families[8];
    uint32_t family_count = 8;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &family_count, families);
    VkPhysicalDeviceMemoryProperties types;
    vkGetPhysicalDeviceMemoryProperties(physical, &types);
    const VkFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    while ((types.memoryTypes[memory_type].propertyFlags & wanted) != wanted) memory_type++;

    /* Two queues of one family, or one queue of each of two. */
    const int split = families[0].queueCount < QUEUES;
    const float priorities[QUEUES] = {1.0f, 1.0f};
    VkDeviceQueueCreateInfo queue_infos[QUEUES] = {
        {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueCount = split ? 1 : QUEUES,
            .pQueuePriorities = priorities},
        {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueFamilyIndex = 1, .queueCount = 1,
            .pQueuePriorities = priorities},
    };
    VkPhysicalDeviceVulkan12Features features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .timelineSemaphore = VK_TRUE};
    VkDeviceCreateInfo device_info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .pNext = &features,
        .queueCreateInfoCount = split ? 2 : 1, .pQueueCreateInfos = queue_infos};
    CHECK(vkCreateDevice(physical, &device_info, NULL, &device));
    for (uint32_t i = 0; i < QUEUES; i++) vkGetDeviceQueue(device, split ? i : 0, split ? 0 : i, &queues[i]);

    pthread_t threads[THREADS];
    for (int i = 0; i < THREADS; i++) {
        Worker* worker = &workers[i];
        VkCommandPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
            .queueFamilyIndex = split ? (uint32_t)i % QUEUES : 0};
        VkFenceCreateInfo fence = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
        worker->number = i;
        CHECK(vkCreateCommandPool(device, &pool, NULL, &worker->pool));
        CHECK(vkCreateFence(device, &fence, NULL, &worker->fence));
        worker->done = timeline();
        worker->seen = timeline();
        worker->source = buffer(&worker->written);
        worker->target = buffer(&worker->read);
    }
    for (int i = 0; i < THREADS; i++) pthread_create(&threads[i], NULL, run, &workers[i]);
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
    for (int i = 0; i < QUEUES; i++) CHECK(vkQueueWaitIdle(queues[i]));
    vkDestroyDevice(device, NULL);
    vkDestroyInstance(instance, NULL);
    return 0;
}
