//! Buffer device addresses: access to buffers through pointers, within their bounds.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{Gpu, Kernel};

/// A buffer with an address and host-visible memory.
struct Addressed {
    raw: vk::Buffer,
    memory: vk::DeviceMemory,
    address: u64,
    words: usize,
    gpu: Gpu,
}

impl Addressed {
    fn of(gpu: &Gpu, words: &[u32]) -> Self {
        let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS | vk::BufferUsageFlags::STORAGE_BUFFER;
        let info = vk::BufferCreateInfo::default().size(size_of_val(words) as u64).usage(usage);
        let device = gpu.device();
        // SAFETY: the create infos are valid, and the memory is as long as the words.
        unsafe {
            let raw = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(raw);
            let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(1)
                .push_next(&mut flags);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_buffer_memory(raw, memory, 0).expect("it is bound");
            let to = device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).expect("it is mapped");
            to.cast::<u32>().copy_from_nonoverlapping(words.as_ptr(), words.len());
            device.unmap_memory(memory);
            let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
            Self { raw, memory, address: device.get_buffer_device_address(&info), words: words.len(), gpu: gpu.clone() }
        }
    }

    fn read(&self) -> Vec<u32> {
        let device = self.gpu.device();
        let mut words = vec![0u32; self.words];
        // SAFETY: the memory has this length, and the device is idle.
        unsafe {
            let from =
                device.map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).expect("it is mapped");
            from.cast::<u32>().copy_to_nonoverlapping(words.as_mut_ptr(), words.len());
            device.unmap_memory(self.memory);
        }
        words
    }

    /// The two words of its address plus an offset in bytes.
    fn at(&self, offset: u64) -> [u32; 2] {
        let address = self.address + offset;
        [address as u32, (address >> 32) as u32]
    }
}

impl Drop for Addressed {
    fn drop(&mut self) {
        // SAFETY: the device is idle.
        unsafe {
            self.gpu.device().destroy_buffer(self.raw, None);
            self.gpu.device().free_memory(self.memory, None);
        }
    }
}

const HEAD: &str = "
    #extension GL_EXT_buffer_reference : require
    #extension GL_EXT_buffer_reference_uvec2 : require
    layout(local_size_x = 1) in;
    layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint word[]; };
    layout(buffer_reference) buffer Node;
    layout(buffer_reference, std430, buffer_reference_align = 16) buffer Node { Node next; uint value; uint pad; };
    layout(push_constant) uniform Push { Words target; Words source; Node first; };";

/// Pointers come from push constants and from memory. Shaders read, write and count atomically through them.
#[gaurast_runner::test(needs = [GLSLANG])]
fn buffers_are_reached_by_their_addresses() {
    let gpu = own();
    let target = Addressed::of(gpu, &[0; 8]);
    let source = Addressed::of(gpu, &[11, 22, 33, 44]);
    assert!(target.address != 0 && source.address != 0 && target.address != source.address);
    assert_eq!(target.address % 16, 0);
    // A list of three nodes, the last of which has a null pointer.
    let last = Addressed::of(gpu, &[0, 0, 300, 0]);
    let [low, high] = last.at(0);
    let second = Addressed::of(gpu, &[low, high, 200, 0]);
    let [low, high] = second.at(0);
    let first = Addressed::of(gpu, &[low, high, 100, 0]);
    let words = compile(
        Stage::Compute,
        &format!(
            "{HEAD}
             void main() {{
                 for (uint i = 0; i < 4; i++) target.word[i] = source.word[3 - i] + 1;
                 uint sum = 0;
                 Node node = first;
                 for (uint i = 0; i < 3; i++) {{ sum += node.value; node = node.next; }}
                 target.word[4] = sum;
                 atomicAdd(target.word[5], 7);
                 atomicAdd(target.word[5], 8);
                 uvec2 address = uvec2(source);
                 target.word[6] = Words(uvec2(address.x + 4, address.y)).word[0];
             }}"
        ),
    );
    let kernel = Kernel::over(gpu, &words, &[]);
    let push = [target.at(0), source.at(0), first.at(0)].concat();
    kernel.run(&[], &push, [1, 1, 1]);
    assert_eq!(target.read(), [45, 34, 23, 12, 600, 15, 22, 0]);
}

/// A read beyond a buffer, before it, or of a destroyed buffer gives zero, and a write there has no effect.
#[gaurast_runner::test(needs = [GLSLANG])]
fn addresses_keep_to_their_buffers() {
    let gpu = own();
    let target = Addressed::of(gpu, &[7; 4]);
    let source = Addressed::of(gpu, &[1, 2, 3, 4]);
    let words = compile(
        Stage::Compute,
        &format!(
            "{HEAD}
             void main() {{
                 target.word[0] = source.word[0];
                 target.word[1] = source.word[4];
                 target.word[2] = source.word[1000000];
                 source.word[5] = 99;
                 target.word[5] = 99;
             }}"
        ),
    );
    let kernel = Kernel::over(gpu, &words, &[]);
    let run = |at: [u32; 2]| {
        kernel.run(&[], &[target.at(0), at, [0, 0]].concat(), [1, 1, 1]);
        target.read()[..3].to_vec()
    };
    assert_eq!(run(source.at(0)), [1, 0, 0]);
    assert_eq!(run(source.at(12)), [4, 0, 0]);
    assert_eq!(run(source.at(16)), [0, 0, 0]);
    assert_eq!(run([0, 0]), [0, 0, 0]);
    assert_eq!(run([!0, !0]), [0, 0, 0]);
    assert_eq!(source.read(), [1, 2, 3, 4]);
    let gone = source.at(0);
    drop(source);
    assert_eq!(run(gone), [0, 0, 0]);
    assert_eq!(target.read()[3], 7);
}
