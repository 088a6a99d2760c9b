//! Mistakes in draws whose numbers are in buffers.

use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Kernel, Message, Pass, PassObject, Resource, Target};

use crate::stage::{Mistake, SIZE, SPLAT, Splat, camera, drawing, mistake, splat, splats};

/// A draw of two Gaussians whose numbers are these words.
fn numbers(name: &'static str, id: &'static str, words: &'static [u32], record: fn(&Commands, &Buffer)) -> Mistake {
    mistake(name, id, move |stage| {
        let buffer = Buffer::of(&stage.full, words);
        drawing(&stage.full, &splats(), &[SPLAT; 2], |commands| {
            commands.camera(&camera());
            record(commands, &buffer);
        })
    })
}

/// Draws as many times as the word after `offset` says, at most `most` times.
fn counted(commands: &Commands, buffer: &Buffer, offset: u64, most: u32) {
    let (device, raw) = commands.raw();
    // SAFETY: see the crate.
    unsafe { device.cmd_draw_indirect_count(raw, buffer.raw, 0, buffer.raw, offset, most, 16) };
}

/// Draws twice by numbers that are some bytes apart.
pub fn strided(commands: &Commands, buffer: &Buffer, stride: u32) {
    let (device, raw) = commands.raw();
    // SAFETY: see the crate.
    unsafe { device.cmd_draw_indirect(raw, buffer.raw, 0, 2, stride) };
}

/// A shader that writes the words that are pushed to it.
const WRITES: &str = "
    layout(local_size_x = 1) in;
    layout(std430, set = 0, binding = 0) buffer Words { uint words[]; };
    layout(push_constant) uniform Pushed { uint number; uint pushed[31]; };
    void main() { for (uint i = 0; i < number; i++) words[i] = pushed[i]; }";

/// Records the dispatch that writes words, and what follows it.
fn write(commands: &Commands, kernel: &Kernel, set: &Bindings, words: &[u32]) {
    let number = u32::try_from(words.len()).expect("few words");
    let pushed = [&[number][..], words].concat();
    kernel.dispatch(commands, &[set.set], &pushed, [1, 1, 1]);
    commands.barrier();
}

/// The messages of an indirect draw of some Gaussians whose numbers a compute shader writes before it; `after` runs in the
/// same command buffer.
pub fn by_compute(gpu: &Gpu, gaussians: &[Splat], words: &[u32], writes_after: bool) -> Vec<Message> {
    let pipeline = splats().create(gpu).expect("a pipeline");
    let target = Target::floats(gpu, SIZE);
    let buffer = Buffer::of(gpu, gaussians.as_flattened());
    let numbers = Buffer::new(gpu, 64);
    let set = Bindings::new(gpu, &[Resource::Storage(numbers.raw)]);
    let kernel = Kernel::new(gpu, WRITES, &set);
    gpu.messages();
    gpu.run(|commands| {
        write(commands, &kernel, &set, words);
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            commands.camera(&camera());
            counted(commands, &numbers, 48, 2);
        });
        if writes_after {
            commands.barrier();
            write(commands, &kernel, &set, &[0; 16]);
        }
    });
    gpu.messages()
}

/// The messages of an indirect draw on a device without features of Vulkan 1.0.
fn plainly(gpu: &Gpu, words: &[u32], count: u32) -> Vec<Message> {
    let target = Target::floats(gpu, SIZE);
    let object = PassObject::new(&target);
    let request = Graphics { subpass: Some((object.render_pass, 0)), ..splats() };
    let pipeline = request.create(gpu).expect("a pipeline");
    let buffer = Buffer::of(gpu, [SPLAT; 2].as_flattened());
    let draws = Buffer::of(gpu, words);
    gpu.messages();
    let recorded = gpu.try_record(|commands| {
        commands.pass(&object, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            commands.camera(&camera());
            commands.draw_indirect(&draws, count);
        });
    });
    if let Ok(recorded) = recorded {
        // The driver may lose the device or leave the draw out.
        let _ = recorded.try_submit();
    }
    gpu.messages()
}

pub fn mistakes() -> Vec<Mistake> {
    let past = "GAURAST-Draw-vertices-past-buffer";
    let counts = "GAURAST-Draw-indirect-count";
    vec![
        numbers("an indirect draw of more Gaussians than the buffer holds", past, &[3, 1, 0, 0], |commands, buffer| {
            commands.draw_indirect(buffer, 1);
        }),
        numbers("a second indirect draw past the buffer", past, &[1, 1, 0, 0, 1, 1, 7, 0], |commands, buffer| {
            commands.draw_indirect(buffer, 2);
        }),
        numbers(
            "a stride of indexed draws for numbers of vertices",
            "GAURAST-Draw-indirect-stride",
            &[2, 1, 0, 0, 2, 1, 0, 0, 0, 0],
            |commands, buffer| strided(commands, buffer, 20),
        ),
        numbers(
            "an indirect draw without an instance",
            "GAURAST-Draw-indirect-instances",
            &[2, 0, 0, 0],
            |commands, buffer| {
                commands.draw_indirect(buffer, 1);
            },
        ),
        numbers("a count above the greatest one", counts, &[1, 1, 0, 0, 9], |commands, buffer| {
            counted(commands, buffer, 16, 1);
        }),
        numbers("a greatest count of 0", counts, &[1, 1, 0, 0, 1], |commands, buffer| {
            counted(commands, buffer, 16, 0);
        }),
        mistake("more Gaussians than an indirect draw may have", "VUID-vkCmdDraw-maxGaussiansPerDraw-90083", |stage| {
            let words = [u32::MAX, u32::MAX, 0, 0];
            let buffer = Buffer::of(&stage.full, &words);
            let target = Target::floats(&stage.full, SIZE);
            let pipeline = splats().create(&stage.full).expect("a pipeline");
            let gaussians = Buffer::of(&stage.full, &SPLAT);
            stage.full.messages();
            let recorded = stage.full.record(|commands| {
                commands.pass(&target, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&gaussians);
                    commands.camera(&camera());
                    commands.draw_indirect(&buffer, 1);
                });
            });
            // The driver bounds the draw by what exists.
            let _ = recorded.try_submit();
            stage.full.messages()
        }),
        mistake(
            "a first instance in an indirect buffer without its feature",
            "VUID-VkDrawIndirectCommand-firstInstance-00501",
            |stage| plainly(&stage.plain, &[1, 1, 0, 1], 1),
        ),
        mistake("several indirect draws without their feature", "VUID-vkCmdDrawIndirect-drawCount-02718", |stage| {
            plainly(&stage.plain, &[1, 1, 0, 0, 1, 1, 1, 0], 2)
        }),
        mistake("numbers past the buffer that a compute shader writes", past, |stage| {
            by_compute(&stage.full, &[SPLAT; 2], &[5, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1], false)
        }),
        mistake("a count that a compute shader writes, above the greatest one", counts, |stage| {
            by_compute(&stage.full, &[SPLAT; 2], &[1, 1, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 7], false)
        }),
        mistake("logarithms that a compute shader's numbers draw", "GAURAST-Draw-negative-scale", |stage| {
            let logarithms = [splat(crate::stage::SCALE, [-2.3; 3]); 2];
            by_compute(&stage.full, &logarithms, &[2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1], false)
        }),
    ]
}
