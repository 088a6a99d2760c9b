//! Semaphores and fences that devices and processes share.

use ash::vk;
use ash::vk::ExternalFenceHandleTypeFlags as FenceTypes;
use ash::vk::ExternalSemaphoreHandleTypeFlags as SemaphoreTypes;
use gaurast_runner::Case;
use gaurast_testkit::devices::{MAPPABLE, open};
use gaurast_testkit::sharing::rustix::event::{EventfdFlags, eventfd};
use gaurast_testkit::sharing::rustix::io::write;
use gaurast_testkit::sharing::{
    buffer_in, exportable, fence, fence_fd, import_fence_of, import_memory, import_semaphore, import_semaphore_of,
    inheritable, inherited, memory_file, semaphore, semaphore_fd, semaphore_file,
};
use gaurast_testkit::{Buffer, Gpu};
use std::os::fd::{AsFd, AsRawFd, IntoRawFd, OwnedFd, RawFd};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

const TEMPORARY: vk::SemaphoreImportFlags = vk::SemaphoreImportFlags::TEMPORARY;
const PERMANENT: vk::SemaphoreImportFlags = vk::SemaphoreImportFlags::empty();

/// The longest wait for what must happen, in nanoseconds.
const SOON: u64 = 60_000_000_000;
/// The wait for what must not happen.
const A_WHILE: u64 = 20_000_000;

/// A submission that waits for and signals semaphores with values, and signals a fence.
fn submit(gpu: &Gpu, waits: &[(vk::Semaphore, u64)], signals: &[(vk::Semaphore, u64)], fence: vk::Fence) {
    submit_commands(gpu, waits, None, signals, fence);
}

fn submit_commands(
    gpu: &Gpu,
    waits: &[(vk::Semaphore, u64)],
    commands: Option<vk::CommandBuffer>,
    signals: &[(vk::Semaphore, u64)],
    fence: vk::Fence,
) {
    let info = |&(semaphore, value): &(vk::Semaphore, u64)| {
        vk::SemaphoreSubmitInfo::default()
            .semaphore(semaphore)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
    };
    let waits: Vec<_> = waits.iter().map(info).collect();
    let signals: Vec<_> = signals.iter().map(info).collect();
    let commands: Vec<_> =
        commands.into_iter().map(|raw| vk::CommandBufferSubmitInfo::default().command_buffer(raw)).collect();
    let submits = [vk::SubmitInfo2::default()
        .wait_semaphore_infos(&waits)
        .command_buffer_infos(&commands)
        .signal_semaphore_infos(&signals)];
    // SAFETY: see the crate.
    unsafe { gpu.device().queue_submit2(gpu.queue(), &submits, fence) }.expect("it is submitted");
}

fn wait_for_fence(gpu: &Gpu, fence: vk::Fence, timeout: u64) -> Result<(), vk::Result> {
    // SAFETY: see the crate.
    unsafe { gpu.device().wait_for_fences(&[fence], true, timeout) }
}

fn wait_for_value(gpu: &Gpu, semaphore: vk::Semaphore, value: u64, timeout: u64) -> Result<(), vk::Result> {
    let (semaphores, values) = ([semaphore], [value]);
    let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
    // SAFETY: see the crate.
    unsafe { gpu.device().wait_semaphores(&wait, timeout) }
}

fn signal(gpu: &Gpu, semaphore: vk::Semaphore, value: u64) {
    let info = vk::SemaphoreSignalInfo::default().semaphore(semaphore).value(value);
    // SAFETY: see the crate.
    unsafe { gpu.device().signal_semaphore(&info) }.expect("it is signaled");
}

fn destroy_semaphores(gpu: &Gpu, semaphores: &[vk::Semaphore]) {
    // SAFETY: see the crate.
    unsafe {
        gpu.device().device_wait_idle().expect("it is idle");
        for &semaphore in semaphores {
            gpu.device().destroy_semaphore(semaphore, None);
        }
    }
}

fn destroy_fences(gpu: &Gpu, fences: &[vk::Fence]) {
    // SAFETY: see the crate.
    unsafe {
        gpu.device().device_wait_idle().expect("it is idle");
        for &fence in fences {
            gpu.device().destroy_fence(fence, None);
        }
    }
}

/// A fence that is not shared.
fn own_fence(gpu: &Gpu) -> vk::Fence {
    fence(gpu, FenceTypes::empty()).unwrap()
}

#[gaurast_runner::test]
fn devices_share_semaphores() {
    let (one, two) = (open(), open());
    for is_timeline in [false, true] {
        let first = semaphore(&one, SemaphoreTypes::OPAQUE_FD, is_timeline.then_some(0)).unwrap();
        let second = import_semaphore(&two, semaphore_file(&one, first).as_fd(), is_timeline).unwrap();
        let done = own_fence(&two);
        for value in 1..4 {
            submit(&two, &[(second, value)], &[], done);
            assert_eq!(wait_for_fence(&two, done, A_WHILE), Err(vk::Result::TIMEOUT));
            submit(&one, &[], &[(first, value)], vk::Fence::null());
            wait_for_fence(&two, done, SOON).unwrap();
            // SAFETY: see the crate.
            unsafe {
                two.device().reset_fences(&[done]).unwrap();
                if is_timeline {
                    assert_eq!(one.device().get_semaphore_counter_value(first).unwrap(), value);
                    assert_eq!(two.device().get_semaphore_counter_value(second).unwrap(), value);
                }
            }
        }
        destroy_semaphores(&one, &[first]);
        destroy_semaphores(&two, &[second]);
        destroy_fences(&two, &[done]);
    }
    assert_eq!(one.message_texts(), [""; 0]);
    assert_eq!(two.message_texts(), [""; 0]);
}

#[gaurast_runner::test]
fn devices_share_fences() {
    let (one, two) = (open(), open());
    let first = fence(&one, FenceTypes::OPAQUE_FD).unwrap();
    let second = own_fence(&two);
    let fd = fence_fd(&one, first, FenceTypes::OPAQUE_FD).unwrap();
    import_fence_of(&two, second, FenceTypes::OPAQUE_FD, vk::FenceImportFlags::empty(), fd).unwrap();
    // SAFETY: see the crate.
    unsafe {
        assert_eq!(wait_for_fence(&two, second, A_WHILE), Err(vk::Result::TIMEOUT));
        std::thread::scope(|scope| {
            scope.spawn(|| wait_for_fence(&two, second, SOON).unwrap());
            std::thread::sleep(Duration::from_millis(5));
            submit(&one, &[], &[], first);
        });
        assert!(one.device().get_fence_status(first).unwrap());
        two.device().reset_fences(&[second]).unwrap();
        assert!(!one.device().get_fence_status(first).unwrap(), "the payload is one");
        submit(&two, &[], &[], second);
        wait_for_fence(&one, first, SOON).unwrap();
    }
    destroy_fences(&one, &[first]);
    destroy_fences(&two, &[second]);
}

/// A wait for several of which one is shared ends as one for the device's own does.
#[gaurast_runner::test]
fn waits_for_own_and_shared_semaphores_end() {
    let (one, two) = (open(), open());
    let first = semaphore(&one, SemaphoreTypes::OPAQUE_FD, Some(0)).unwrap();
    let second = import_semaphore(&two, semaphore_file(&one, first).as_fd(), true).unwrap();
    let own = semaphore(&two, SemaphoreTypes::empty(), Some(0)).unwrap();
    let (semaphores, values) = ([second, own], [1, 1]);
    let all = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
    let any = all.flags(vk::SemaphoreWaitFlags::ANY);
    // SAFETY: see the crate.
    let wait = |info: &vk::SemaphoreWaitInfo<'_>, timeout| unsafe { two.device().wait_semaphores(info, timeout) };
    assert_eq!(wait(&any, A_WHILE), Err(vk::Result::TIMEOUT));
    std::thread::scope(|scope| {
        scope.spawn(|| wait(&any, SOON).unwrap());
        std::thread::sleep(Duration::from_millis(5));
        signal(&one, first, 1);
    });
    assert_eq!(wait(&all, A_WHILE), Err(vk::Result::TIMEOUT));
    std::thread::scope(|scope| {
        scope.spawn(|| wait(&all, SOON).unwrap());
        std::thread::sleep(Duration::from_millis(5));
        signal(&two, own, 1);
    });
    destroy_semaphores(&one, &[first]);
    destroy_semaphores(&two, &[second, own]);
}

/// A semaphore of a device, a fence of another one that is signaled after it, and what holds the semaphore back.
struct Chain {
    one: Gpu,
    two: Gpu,
    /// The host signals it, and then the first device signals `signaled`.
    gate: vk::Semaphore,
    signaled: vk::Semaphore,
    waited: vk::Semaphore,
    /// The first device's semaphore with the payload that is `waited`'s own.
    released: vk::Semaphore,
    done: vk::Fence,
}

impl Chain {
    fn new() -> Self {
        let (one, two) = (open(), open());
        let gate = semaphore(&one, SemaphoreTypes::empty(), Some(0)).unwrap();
        let signaled = semaphore(&one, SemaphoreTypes::SYNC_FD, None).unwrap();
        let waited = semaphore(&two, SemaphoreTypes::OPAQUE_FD, None).unwrap();
        let released = import_semaphore(&one, semaphore_file(&two, waited).as_fd(), false).unwrap();
        let done = own_fence(&two);
        Self { one, two, gate, signaled, waited, released, done }
    }

    fn export(&self) -> Result<RawFd, vk::Result> {
        semaphore_fd(&self.one, self.signaled, SemaphoreTypes::SYNC_FD)
    }

    /// Submits a wait on the second device.
    fn wait(&self) {
        submit(&self.two, &[(self.waited, 0)], &[], self.done);
    }

    fn end(self) {
        destroy_semaphores(&self.one, &[self.gate, self.signaled, self.released]);
        destroy_semaphores(&self.two, &[self.waited]);
        destroy_fences(&self.two, &[self.done]);
    }
}

/// The descriptor of an export, which waits until the host signals `gate`: -1, which is signaled.
fn exported_late(gpu: &Gpu, gate: vk::Semaphore, export: impl FnOnce() -> RawFd + Send) -> RawFd {
    std::thread::scope(|scope| {
        let exporter = scope.spawn(export);
        std::thread::sleep(Duration::from_nanos(A_WHILE));
        assert!(!exporter.is_finished(), "it waits");
        signal(gpu, gate, 1);
        let fd = exporter.join().expect("an export");
        assert_eq!(fd, -1);
        fd
    })
}

/// An event counter, which is polled as the sync files of the host's drivers are, in the place of one.
#[gaurast_runner::test]
fn a_queue_waits_for_a_sync_file() {
    let gpu = open();
    let counter = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
    let waited = semaphore(&gpu, SemaphoreTypes::empty(), None).unwrap();
    let done = own_fence(&gpu);
    let fd = counter.try_clone().unwrap().into_raw_fd();
    import_semaphore_of(&gpu, waited, SemaphoreTypes::SYNC_FD, TEMPORARY, fd).unwrap();
    submit(&gpu, &[(waited, 0)], &[], done);
    assert_eq!(wait_for_fence(&gpu, done, A_WHILE), Err(vk::Result::TIMEOUT));
    write(&counter, &1u64.to_ne_bytes()).unwrap();
    wait_for_fence(&gpu, done, SOON).unwrap();
    destroy_semaphores(&gpu, &[waited]);
    destroy_fences(&gpu, &[done]);
}

/// A reset ends an import, and unsignals the fence's own payload.
#[gaurast_runner::test]
fn a_reset_is_of_the_own_payload() {
    let gpu = open();
    let own = own_fence(&gpu);
    submit(&gpu, &[], &[], own);
    wait_for_fence(&gpu, own, SOON).unwrap();
    import_fence_of(&gpu, own, FenceTypes::SYNC_FD, vk::FenceImportFlags::TEMPORARY, -1).unwrap();
    // SAFETY: see the crate.
    unsafe {
        gpu.device().reset_fences(&[own]).unwrap();
        assert!(!gpu.device().get_fence_status(own).unwrap());
    }
    destroy_fences(&gpu, &[own]);
}

/// A submission that fails changes no semaphore: an import that it waits for is there for the next.
#[gaurast_runner::test]
fn a_failed_submission_leaves_an_import() {
    let gpu = open();
    let waited = semaphore(&gpu, SemaphoreTypes::empty(), None).unwrap();
    let done = own_fence(&gpu);
    import_semaphore_of(&gpu, waited, SemaphoreTypes::SYNC_FD, TEMPORARY, -1).unwrap();
    let wait = [vk::SemaphoreSubmitInfo::default().semaphore(waited)];
    let no_commands = [vk::CommandBufferSubmitInfo::default()];
    let submits = [vk::SubmitInfo2::default().wait_semaphore_infos(&wait).command_buffer_infos(&no_commands)];
    // SAFETY: see the crate; the command buffer is null.
    let result = unsafe { gpu.device().queue_submit2(gpu.queue(), &submits, vk::Fence::null()) };
    assert!(result.is_err(), "a null command buffer");
    submit(&gpu, &[(waited, 0)], &[], done);
    wait_for_fence(&gpu, done, SOON).unwrap();
    destroy_semaphores(&gpu, &[waited]);
    destroy_fences(&gpu, &[done]);
}

/// Breaks VUID-VkSemaphoreGetFdInfoKHR-handleType-01135.
#[gaurast_runner::test]
fn a_sync_file_of_a_semaphore_is_exported_before_the_signal() {
    let chain = Chain::new();
    assert!(chain.export().is_err(), "nothing will signal it");
    assert!(chain.one.message_texts().concat().contains("nothing submitted will signal"));
    submit(&chain.one, &[(chain.gate, 1)], &[(chain.signaled, 0)], vk::Fence::null());
    let fd = exported_late(&chain.one, chain.gate, || chain.export().unwrap());
    assert!(chain.export().is_err(), "the export has reset it");
    import_semaphore_of(&chain.two, chain.waited, SemaphoreTypes::SYNC_FD, TEMPORARY, fd).unwrap();
    chain.wait();
    wait_for_fence(&chain.two, chain.done, SOON).unwrap();
    // The import has ended with the wait, so the semaphore has its own payload again.
    // SAFETY: see the crate.
    unsafe { chain.two.device().reset_fences(&[chain.done]).unwrap() };
    chain.wait();
    assert_eq!(wait_for_fence(&chain.two, chain.done, A_WHILE), Err(vk::Result::TIMEOUT));
    submit(&chain.one, &[], &[(chain.released, 0)], vk::Fence::null());
    wait_for_fence(&chain.two, chain.done, SOON).unwrap();
    chain.end();
}

#[gaurast_runner::test]
fn a_sync_file_of_a_semaphore_is_exported_after_the_signal() {
    let chain = Chain::new();
    submit(&chain.one, &[], &[(chain.signaled, 0)], vk::Fence::null());
    // SAFETY: see the crate.
    unsafe { chain.one.device().device_wait_idle().unwrap() };
    assert_eq!(chain.export().unwrap(), -1);
    assert!(chain.export().is_err(), "the export has reset it");
    import_semaphore_of(&chain.two, chain.waited, SemaphoreTypes::SYNC_FD, TEMPORARY, -1).unwrap();
    chain.wait();
    wait_for_fence(&chain.two, chain.done, SOON).unwrap();
    chain.end();
}

/// Breaks VUID-VkFenceGetFdInfoKHR-handleType-01454.
#[gaurast_runner::test]
fn a_sync_file_of_a_fence_is_exported_before_and_after_the_signal() {
    let (one, two) = (open(), open());
    let gate = semaphore(&one, SemaphoreTypes::empty(), Some(0)).unwrap();
    let first = fence(&one, FenceTypes::SYNC_FD).unwrap();
    let second = own_fence(&two);
    let export = || fence_fd(&one, first, FenceTypes::SYNC_FD);
    let temporary = vk::FenceImportFlags::TEMPORARY;
    assert!(export().is_err(), "nothing will signal it");
    submit(&one, &[(gate, 1)], &[], first);
    let fd = exported_late(&one, gate, || export().unwrap());
    import_fence_of(&two, second, FenceTypes::SYNC_FD, temporary, fd).unwrap();
    wait_for_fence(&two, second, SOON).unwrap();
    // SAFETY: see the crate.
    unsafe {
        one.device().device_wait_idle().unwrap();
        assert!(!one.device().get_fence_status(first).unwrap(), "the export has reset it");
        two.device().reset_fences(&[second]).unwrap();
        assert!(!two.device().get_fence_status(second).unwrap(), "the import has ended");
    }
    submit(&one, &[], &[], first);
    wait_for_fence(&one, first, SOON).unwrap();
    assert_eq!(export().unwrap(), -1);
    import_fence_of(&two, second, FenceTypes::SYNC_FD, temporary, -1).unwrap();
    wait_for_fence(&two, second, 0).unwrap();
    destroy_semaphores(&one, &[gate]);
    destroy_fences(&one, &[first]);
    destroy_fences(&two, &[second]);
}

/// Breaks VUID-VkExportSemaphoreCreateInfo-handleTypes-01124, VUID-VkSemaphoreGetFdInfoKHR-handleType-01132,
/// VUID-VkImportSemaphoreFdInfoKHR-handleType-01143, VUID-VkImportSemaphoreFdInfoKHR-handleType-07307 and
/// VUID-VkImportSemaphoreFdInfoKHR-flags-03323.
#[gaurast_runner::test]
fn what_semaphores_cannot_share_is_refused() {
    let gpu = open();
    let (opaque, sync) = (SemaphoreTypes::OPAQUE_FD, SemaphoreTypes::SYNC_FD);
    assert!(semaphore(&gpu, opaque | sync, None).is_err());
    assert!(semaphore(&gpu, sync, Some(0)).is_err());
    assert!(semaphore(&gpu, SemaphoreTypes::OPAQUE_WIN32, None).is_err());
    let binary = semaphore(&gpu, opaque, None).unwrap();
    let timeline = semaphore(&gpu, opaque, Some(0)).unwrap();
    let own = semaphore(&gpu, SemaphoreTypes::empty(), None).unwrap();
    for (semaphore, handle_type) in [(own, opaque), (own, sync), (binary, sync), (timeline, sync)] {
        assert!(semaphore_fd(&gpu, semaphore, handle_type).is_err(), "{handle_type:?}");
    }
    let file = semaphore_file(&gpu, binary);
    let of_timeline = semaphore_file(&gpu, timeline);
    let null: OwnedFd = std::fs::File::open("/dev/null").unwrap().into();
    for (semaphore, handle_type, flags, fd) in [
        (own, SemaphoreTypes::OPAQUE_WIN32, PERMANENT, file.as_raw_fd()),
        (own, sync, PERMANENT, -1),
        (timeline, sync, TEMPORARY, -1),
        (timeline, opaque, TEMPORARY, of_timeline.as_raw_fd()),
        (timeline, opaque, PERMANENT, file.as_raw_fd()),
        (own, opaque, PERMANENT, of_timeline.as_raw_fd()),
        (own, opaque, PERMANENT, null.as_raw_fd()),
        (own, opaque, PERMANENT, -1),
        (own, sync, TEMPORARY, null.as_raw_fd()),
        (own, sync, TEMPORARY, file.as_raw_fd()),
        (own, sync, TEMPORARY, i32::MAX),
    ] {
        assert!(import_semaphore_of(&gpu, semaphore, handle_type, flags, fd).is_err(), "{handle_type:?} {fd}");
    }
    let texts = gpu.message_texts();
    assert_eq!(texts.len(), 3 + 4 + 11, "{texts:#?}");
    // The semaphore is what it was.
    let done = own_fence(&gpu);
    submit(&gpu, &[], &[(own, 0)], vk::Fence::null());
    submit(&gpu, &[(own, 0)], &[], done);
    wait_for_fence(&gpu, done, SOON).unwrap();
    destroy_semaphores(&gpu, &[binary, timeline, own]);
    destroy_fences(&gpu, &[done]);
}

/// Breaks VUID-VkExportFenceCreateInfo-handleTypes-01446, VUID-VkFenceGetFdInfoKHR-handleType-01453,
/// VUID-VkImportFenceFdInfoKHR-handleType-01464 and VUID-VkImportFenceFdInfoKHR-handleType-07306.
#[gaurast_runner::test]
fn what_fences_cannot_share_is_refused() {
    let gpu = open();
    let (opaque, sync) = (FenceTypes::OPAQUE_FD, FenceTypes::SYNC_FD);
    assert!(fence(&gpu, opaque | sync).is_err());
    assert!(fence(&gpu, FenceTypes::OPAQUE_WIN32).is_err());
    let shared = fence(&gpu, opaque).unwrap();
    let own = own_fence(&gpu);
    for (fence, handle_type) in [(own, opaque), (own, sync), (shared, sync)] {
        assert!(fence_fd(&gpu, fence, handle_type).is_err(), "{handle_type:?}");
    }
    let semaphore = semaphore(&gpu, SemaphoreTypes::OPAQUE_FD, None).unwrap();
    let file = semaphore_file(&gpu, semaphore);
    let (permanent, temporary) = (vk::FenceImportFlags::empty(), vk::FenceImportFlags::TEMPORARY);
    for (handle_type, flags, fd) in [
        (FenceTypes::OPAQUE_WIN32, permanent, 0),
        (sync, permanent, -1),
        (opaque, permanent, -1),
        (opaque, permanent, file.as_raw_fd()),
        (sync, temporary, file.as_raw_fd()),
    ] {
        assert!(import_fence_of(&gpu, own, handle_type, flags, fd).is_err(), "{handle_type:?} {fd}");
    }
    assert_eq!(gpu.message_texts().len(), 2 + 3 + 5);
    destroy_semaphores(&gpu, &[semaphore]);
    destroy_fences(&gpu, &[shared, own]);
}

#[gaurast_runner::test]
fn queries_say_what_can_be_shared() {
    let gpu = open();
    let (instance, device) = (gpu.instance(), gpu.physical_device());
    let both = vk::ExternalSemaphoreFeatureFlags::EXPORTABLE | vk::ExternalSemaphoreFeatureFlags::IMPORTABLE;
    for (handle_type, kind, is_shared) in [
        (SemaphoreTypes::OPAQUE_FD, vk::SemaphoreType::BINARY, true),
        (SemaphoreTypes::OPAQUE_FD, vk::SemaphoreType::TIMELINE, true),
        (SemaphoreTypes::SYNC_FD, vk::SemaphoreType::BINARY, true),
        (SemaphoreTypes::SYNC_FD, vk::SemaphoreType::TIMELINE, false),
        (SemaphoreTypes::OPAQUE_WIN32, vk::SemaphoreType::BINARY, false),
    ] {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(kind);
        let info = vk::PhysicalDeviceExternalSemaphoreInfo::default().handle_type(handle_type).push_next(&mut kind);
        let mut found = vk::ExternalSemaphoreProperties::default();
        // SAFETY: see the crate.
        unsafe { instance.get_physical_device_external_semaphore_properties(device, &info, &mut found) };
        let types = if is_shared { handle_type } else { SemaphoreTypes::empty() };
        assert_eq!(found.compatible_handle_types, types);
        assert_eq!(found.export_from_imported_handle_types, types);
        assert_eq!(found.external_semaphore_features == both, is_shared);
        assert_eq!(found.external_semaphore_features.is_empty(), !is_shared);
    }
    for (handle_type, is_shared) in
        [(FenceTypes::OPAQUE_FD, true), (FenceTypes::SYNC_FD, true), (FenceTypes::OPAQUE_WIN32, false)]
    {
        let info = vk::PhysicalDeviceExternalFenceInfo::default().handle_type(handle_type);
        let mut found = vk::ExternalFenceProperties::default();
        // SAFETY: see the crate.
        unsafe { instance.get_physical_device_external_fence_properties(device, &info, &mut found) };
        let types = if is_shared { handle_type } else { FenceTypes::empty() };
        assert_eq!((found.compatible_handle_types, found.export_from_imported_handle_types), (types, types));
        assert_eq!(found.external_fence_features.is_empty(), !is_shared);
    }
}

/// The variables of the environment by which a child finds its files.
const MEMORY: &str = "GAURAST_TEST_MEMORY_FILE";
const TIMELINE: &str = "GAURAST_TEST_TIMELINE_FILE";
const TO_CHILD: &str = "GAURAST_TEST_TO_CHILD_FILE";
const TO_PARENT: &str = "GAURAST_TEST_TO_PARENT_FILE";

/// The bytes of the shared memory.
const SIZE: u64 = 4096;
/// Round trips of the hosts, by a timeline.
const HOST_TRIPS: u64 = 10_000;
/// Round trips of the queues, by binary semaphores.
const QUEUE_TRIPS: u32 = 1_000;

/// The shared objects of a process.
struct Side {
    gpu: Gpu,
    memory: vk::DeviceMemory,
    buffer: vk::Buffer,
    timeline: vk::Semaphore,
    to_child: vk::Semaphore,
    to_parent: vk::Semaphore,
}

impl Side {
    /// The number in the memory, which both hosts have mapped.
    fn mapped(&self) -> &AtomicU64 {
        // SAFETY: see the crate; the memory is mapped until it is freed.
        unsafe {
            let none = vk::MemoryMapFlags::empty();
            let start = self.gpu.device().map_memory(self.memory, 0, vk::WHOLE_SIZE, none).unwrap();
            AtomicU64::from_ptr(start.cast())
        }
    }

    fn end(self) {
        destroy_semaphores(&self.gpu, &[self.timeline, self.to_child, self.to_parent]);
        // SAFETY: see the crate.
        unsafe {
            self.gpu.device().destroy_buffer(self.buffer, None);
            self.gpu.device().free_memory(self.memory, None);
        }
    }
}

/// Every number is from the other process, by memory alone: the semaphores make it visible.
#[gaurast_runner::test]
fn processes_take_turns(case: &Case) {
    if std::env::var_os(MEMORY).is_some() {
        return take_turns_as_child();
    }
    let gpu = open();
    let memory = exportable(&gpu, SIZE, MAPPABLE);
    let binary = || semaphore(&gpu, SemaphoreTypes::OPAQUE_FD, None).unwrap();
    let timeline = semaphore(&gpu, SemaphoreTypes::OPAQUE_FD, Some(0)).unwrap();
    let (to_child, to_parent) = (binary(), binary());
    let buffer = buffer_in(&gpu, memory, SIZE);
    let files = [
        (MEMORY, inheritable(memory_file(&gpu, memory))),
        (TIMELINE, inheritable(semaphore_file(&gpu, timeline))),
        (TO_CHILD, inheritable(semaphore_file(&gpu, to_child))),
        (TO_PARENT, inheritable(semaphore_file(&gpu, to_parent))),
    ];
    let side = Side { gpu, memory, buffer, timeline, to_child, to_parent };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            case.run_alone(|command| {
                command.envs(files.iter().map(|(variable, (_, number))| (variable, number)));
            });
        });
        take_turns_as_parent(&side);
    });
    side.end();
}

fn take_turns_as_parent(side: &Side) {
    let gpu = &side.gpu;
    let number = side.mapped();
    for trip in 0..HOST_TRIPS {
        number.store(trip + 100, Ordering::Relaxed);
        signal(gpu, side.timeline, 2 * trip + 1);
        wait_for_value(gpu, side.timeline, 2 * trip + 2, SOON).unwrap();
        assert_eq!(number.load(Ordering::Relaxed), trip + 101, "of the child");
    }
    let read = Buffer::new(gpu, 4);
    let done = own_fence(gpu);
    for trip in 0..QUEUE_TRIPS {
        let fill = gpu.record(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_fill_buffer(commands, side.buffer, 0, 4, trip) };
        });
        let copy = copy_of(gpu, side.buffer, 4, &read);
        submit_commands(gpu, &[], Some(fill.raw), &[(side.to_child, 0)], vk::Fence::null());
        submit_commands(gpu, &[(side.to_parent, 0)], Some(copy.raw), &[], done);
        wait_for_fence(gpu, done, SOON).unwrap();
        // SAFETY: see the crate.
        unsafe { gpu.device().reset_fences(&[done]).unwrap() };
        assert_eq!(read.values::<u32>(), [trip], "what the child has copied");
    }
    destroy_fences(gpu, &[done]);
}

/// Commands that copy a word at an offset of the shared buffer.
fn copy_of(gpu: &Gpu, shared: vk::Buffer, offset: u64, to: &Buffer) -> gaurast_testkit::Recorded {
    gpu.record(|recording| {
        let (device, commands) = recording.raw();
        let region = [vk::BufferCopy::default().src_offset(offset).size(4)];
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_buffer(commands, shared, to.raw, &region) };
    })
}

fn take_turns_as_child() {
    let gpu = open();
    let memory = import_memory(&gpu, inherited(MEMORY).as_fd(), SIZE, MAPPABLE).unwrap();
    let import = |variable, is_timeline| import_semaphore(&gpu, inherited(variable).as_fd(), is_timeline).unwrap();
    let (timeline, to_child, to_parent) = (import(TIMELINE, true), import(TO_CHILD, false), import(TO_PARENT, false));
    let buffer = buffer_in(&gpu, memory, SIZE);
    let side = Side { gpu, memory, buffer, timeline, to_child, to_parent };
    let gpu = &side.gpu;
    let number = side.mapped();
    for trip in 0..HOST_TRIPS {
        wait_for_value(gpu, side.timeline, 2 * trip + 1, SOON).unwrap();
        let old = number.load(Ordering::Relaxed);
        assert_eq!(old, trip + 100, "of the parent");
        number.store(old + 1, Ordering::Relaxed);
        // The queue signals as well as the host.
        if trip % 2 == 0 {
            signal(gpu, side.timeline, 2 * trip + 2);
        } else {
            submit(gpu, &[], &[(side.timeline, 2 * trip + 2)], vk::Fence::null());
        }
    }
    let copy = gpu.record(|recording| {
        let (device, commands) = recording.raw();
        let region = [vk::BufferCopy::default().dst_offset(4).size(4)];
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_buffer(commands, side.buffer, side.buffer, &region) };
    });
    let done = own_fence(gpu);
    for _ in 0..QUEUE_TRIPS {
        submit_commands(gpu, &[(side.to_child, 0)], Some(copy.raw), &[(side.to_parent, 0)], done);
        wait_for_fence(gpu, done, SOON).unwrap();
        // SAFETY: see the crate.
        unsafe { gpu.device().reset_fences(&[done]).unwrap() };
    }
    destroy_fences(gpu, &[done]);
    side.end();
}

/// A child ends without the signal that its parent waits for.
#[gaurast_runner::test]
fn waits_for_a_process_that_has_ended_time_out(case: &Case) {
    if std::env::var_os(TIMELINE).is_some() {
        let gpu = open();
        let timeline = import_semaphore(&gpu, inherited(TIMELINE).as_fd(), true).unwrap();
        signal(&gpu, timeline, 1);
        return;
    }
    let gpu = open();
    let timeline = semaphore(&gpu, SemaphoreTypes::OPAQUE_FD, Some(0)).unwrap();
    let (_file, number) = inheritable(semaphore_file(&gpu, timeline));
    let done = own_fence(&gpu);
    submit(&gpu, &[(timeline, 2)], &[], done);
    case.run_alone(|command| {
        command.env(TIMELINE, &number);
    });
    wait_for_value(&gpu, timeline, 1, 0).unwrap();
    let start = Instant::now();
    assert_eq!(wait_for_value(&gpu, timeline, 2, A_WHILE), Err(vk::Result::TIMEOUT));
    assert_eq!(wait_for_fence(&gpu, done, A_WHILE), Err(vk::Result::TIMEOUT));
    assert!(start.elapsed() >= Duration::from_nanos(2 * A_WHILE));
    // The payload is this process's as much as the other's.
    signal(&gpu, timeline, 2);
    wait_for_fence(&gpu, done, SOON).unwrap();
    destroy_semaphores(&gpu, &[timeline]);
    destroy_fences(&gpu, &[done]);
}
