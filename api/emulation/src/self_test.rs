//! The test of a device's arithmetic: whether operations on pairs give the bits that they must. A compiler that contracts,
//! reorders or flushes gives others, and the pictures would be wrong by more than the extension allows.

use std::sync::Arc;

use ash::vk;
use gaurast_layer_interface::SetDeviceLoaderData;

use crate::kernels::{self, PUSHED};
use crate::next::Next;
use crate::pair::{self, Pair};
use crate::scratch::Memory;

/// Pairs of operands, one for each invocation.
const COUNT: usize = 64;
/// Results of an invocation: sum, product, sum and product of pairs, quotient, root.
const RESULTS: usize = 6;

/// The operands of an invocation.
fn operands(index: usize) -> [Pair; 2] {
    // A generator of remainders: any numbers do that have all of their bits.
    let mut state = 0x9E37_79B9_u32.wrapping_mul(index as u32 + 1);
    let mut next = |exponent: i32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let fraction = 1.0 + (state >> 9) as f32 / 8_388_608.0;
        fraction * 2_f32.powi(exponent)
    };
    let exponent = index as i32 % 17 - 8;
    let sign = if index.is_multiple_of(3) { -1.0 } else { 1.0 };
    let a = pair::two_sum(next(exponent), next(exponent - 26));
    let b = pair::two_sum(sign * next(2 - exponent / 2), next(-26 - exponent / 2));
    [a, b]
}

fn bits(value: Pair) -> [u32; 2] {
    value.map(f32::to_bits)
}

fn wide(value: Pair) -> f64 {
    f64::from(value[0]) + f64::from(value[1])
}

/// Reports whether the results of an invocation are those of the operations.
fn is_right(index: usize, results: &[Pair; RESULTS]) -> bool {
    let [a, b] = operands(index);
    let exact = [pair::two_sum(a[0], b[0]), pair::two_product(a[0], b[0]), pair::add(a, b), pair::mul(a, b)];
    let are_exact = exact.iter().zip(results).all(|(right, found)| bits(*right) == bits(*found));
    // Quotients and roots begin with an operation of which Vulkan leaves the last bits open; what corrects it does not.
    let near = |found: Pair, right: f64| ((wide(found) - right) / right).abs() < 2_f64.powi(-42);
    are_exact && near(results[4], wide(a) / wide(b)) && near(results[5], wide(a).sqrt())
}

/// A queue to run the test on.
#[derive(Clone, Copy)]
pub(crate) struct TestQueue {
    pub(crate) family: u32,
    pub(crate) set_loader_data: Option<SetDeviceLoaderData>,
}

/// Runs the test; `Ok(false)` if a result is wrong.
///
/// # Safety
/// The device has just been created with a queue 0 of the family, which nobody else uses.
pub(crate) unsafe fn passes(next: &Arc<Next>, queue: TestQueue) -> Result<bool, vk::Result> {
    let memory = Memory::new(next, (COUNT * (2 + RESULTS) * 8) as u64, true)?;
    for index in 0..COUNT {
        for (place, number) in operands(index).as_flattened().iter().enumerate() {
            memory.set_word(4 * index + place, number.to_bits());
        }
    }
    let first = 4 * COUNT;
    // SAFETY: the caller's promise; all objects are destroyed once the queue is idle.
    unsafe {
        let pool =
            next.create_command_pool(&vk::CommandPoolCreateInfo::default().queue_family_index(queue.family), None)?;
        let module = kernels::module(next, kernels::SELF_TEST)?;
        let layout = kernels::layout(next, &[], vk::ShaderStageFlags::COMPUTE)?;
        let pipeline = kernels::compute(next, module, layout, &[])?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = next.allocate_command_buffers(&info)?[0];
        let raw_queue = next.get_device_queue(queue.family, 0);
        if let Some(set) = queue.set_loader_data {
            use vk::Handle;
            set(next.handle(), commands.as_raw() as *mut std::ffi::c_void).result()?;
            set(next.handle(), raw_queue.as_raw() as *mut std::ffi::c_void).result()?;
        }
        let mut pushed = [0_u64; PUSHED as usize / 8];
        pushed[..2].copy_from_slice(&[memory.address, memory.address + 4 * first as u64]);
        next.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())?;
        next.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, pipeline);
        let stages = vk::ShaderStageFlags::COMPUTE;
        next.cmd_push_constants(commands, layout, stages, 0, bytemuck::cast_slice(&pushed));
        next.cmd_dispatch(commands, 1, 1, 1);
        let barrier = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::SHADER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        let (from, to) = (vk::PipelineStageFlags::COMPUTE_SHADER, vk::PipelineStageFlags::HOST);
        next.cmd_pipeline_barrier(commands, from, to, vk::DependencyFlags::empty(), &barrier, &[], &[]);
        next.end_command_buffer(commands)?;
        let buffers = [commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
        next.queue_submit(raw_queue, &submit, vk::Fence::null())?;
        next.queue_wait_idle(raw_queue)?;
        next.destroy_command_pool(pool, None);
        next.destroy_pipeline(pipeline, None);
        next.destroy_pipeline_layout(layout, None);
        next.destroy_shader_module(module, None);
    }
    let found = |index: usize| -> [Pair; RESULTS] {
        std::array::from_fn(|result| {
            [0, 1].map(|half| f32::from_bits(memory.word(first + 2 * (RESULTS * index + result) + half)))
        })
    };
    Ok((0..COUNT).all(|index| is_right(index, &found(index))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_sums_and_products() {
        for index in 0..COUNT {
            let [a, b] = operands(index);
            let near = |found: Pair, right: f64, scale: f64| ((wide(found) - right) / scale).abs() < 2_f64.powi(-45);
            assert!(near(pair::add(a, b), wide(a) + wide(b), wide(a).abs() + wide(b).abs()));
            assert!(near(pair::mul(a, b), wide(a) * wide(b), (wide(a) * wide(b)).abs()));
            let product = pair::two_product(a[0], b[0]);
            assert_eq!(wide(product), f64::from(a[0]) * f64::from(b[0]), "the product is exact");
        }
    }

    #[test]
    fn binary32_does_not_pass() {
        let [a, b] = operands(5);
        let plain = [a[0] + b[0], a[0] * b[0], a[0] + b[0], a[0] * b[0], a[0] / b[0], a[0].sqrt()].map(|x| [x, 0.0]);
        assert!(!is_right(5, &plain));
    }
}
