//! The standard library aborts if an allocation fails that has no error handling. This test shows that there is no such
//! allocation above a certain size: the host's allocator fails here, once in each of many processes, while the driver
//! executes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering::Relaxed};

use ash::vk;
use gaurast_runner::{Case, Variant};
use gaurast_testkit::Settings;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, depth_test};
use gaurast_tests::many_gaussians::{self, Mode};

/// The size in bytes from which an allocation may fail. Smaller sizes do not depend on an application.
const LARGE: usize = 64 << 10;
/// The variable that tells a process of this test which allocation fails.
const VARIABLE: &str = "GAURAST_TEST_FAIL";
/// The output of such a process if it had no such allocation.
const NONE: &str = "none failed";

struct Failing;

static ARMED: AtomicBool = AtomicBool::new(false);
static LEFT: AtomicI64 = AtomicI64::new(i64::MAX);

fn fails(size: usize) -> bool {
    size >= LARGE && ARMED.load(Relaxed) && LEFT.fetch_sub(1, Relaxed) == 0
}

// SAFETY: it is the system's allocator, which may fail at any time.
unsafe impl GlobalAlloc for Failing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if fails(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: the caller guarantees it.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if fails(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: the caller guarantees it.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if fails(size) {
            return std::ptr::null_mut();
        }
        // SAFETY: the caller guarantees it.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller guarantees it.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Failing = Failing;

fn arm(armed: bool) {
    ARMED.store(armed, Relaxed);
}

/// Draws many overlapping triangles, some of them clipped, with four samples and a resolve.
fn draw_triangles(gpu: &Gpu, count: usize) {
    let target = Target::new(
        gpu,
        &TargetOptions {
            size: [640, 480],
            colors: vec![vk::Format::R8G8B8A8_UNORM],
            depth: Some(vk::Format::D32_SFLOAT),
            samples: 4,
            resolve: true,
        },
    );
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertex = |index: usize| {
        let at = |factor: usize, period: usize| (index * factor % period) as f32 / period as f32;
        Vertex {
            position: [3.0 * at(7, 101) - 1.5, 3.0 * at(13, 97) - 1.5, at(29, 89), 1.0],
            color: [at(3, 7), at(5, 11), at(2, 5), 1.0],
        }
    };
    let vertices: Vec<_> = (0..3 * count).map(vertex).collect();
    let buffer = Buffer::of(gpu, &vertices);
    arm(true);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            commands.draw(0..vertices.len() as u32);
        });
    });
    arm(false);
}

/// Fails the `n`th allocation while large draws of a scenario are executed. The parent process checks the result.
fn fail_one(scenario: &str, n: i64) {
    LEFT.store(n, Relaxed);
    let settings = Settings { threads: Some(2), ..Settings::default() };
    std::panic::set_hook(Box::new(|info| {
        arm(false);
        eprintln!("{info}");
    }));
    match scenario {
        "gaussians" => {
            let context = Gpu::embedded(&settings).expect("a device");
            many_gaussians::draw(&context, &many_gaussians::scene(60_000), [640, 480], Mode::default(), arm);
        }
        _ => {
            let gpu = Gpu::embedded(&settings).expect("a device");
            draw_triangles(&gpu, 40_000);
        }
    }
    if LEFT.load(Relaxed) >= 0 {
        println!("{NONE}");
    }
}

fn drawn() -> Vec<Variant> {
    vec![Variant::new("gaussians"), Variant { needs: vec![GLSLANG], ..Variant::new("triangles") }]
}

#[gaurast_runner::test(each = drawn())]
fn no_large_allocation_aborts(case: &Case) {
    if case.is_alone() {
        let n = std::env::var(VARIABLE).expect("an allocation");
        return fail_one(case.variant(), n.parse().expect("a number"));
    }
    let (mut n, mut lost) = (0, 0);
    loop {
        let output = case.command().env(VARIABLE, n.to_string()).output().expect("it starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        if stdout.contains(NONE) {
            break;
        }
        // The driver either worked without the memory or reported the failure.
        let told = stderr.contains("ERROR_DEVICE_LOST") || stderr.contains("OUT_OF");
        assert!(
            output.status.code().is_some() && (output.status.success() || told),
            "allocation {n}: {:?}\n{stderr}",
            output.status
        );
        lost += u32::from(told);
        n += 1 + n / 8;
    }
    assert!(lost > 0, "of {n} large allocations none was told");
}
