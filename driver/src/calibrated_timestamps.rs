//! Calibrated timestamps: the device's clock and the host's, read together.

use crate::abi::error::Error;
use crate::abi::valid;
use crate::device::Device;
use crate::instance::PhysicalDevice;
use ash::vk;
use simdevice::stats::query::host_time;

/// The host's clocks that have a time domain: their domains, and functions that read them in nanoseconds.
#[cfg(target_os = "linux")]
const HOST: [(vk::TimeDomainKHR, fn() -> u64); 2] = {
    use rustix::time::{ClockId, clock_gettime};
    fn nanoseconds(clock: ClockId) -> u64 {
        let time = clock_gettime(clock);
        time.tv_sec.unsigned_abs() * 1_000_000_000 + time.tv_nsec.unsigned_abs()
    }
    [
        (vk::TimeDomainKHR::CLOCK_MONOTONIC, || nanoseconds(ClockId::Monotonic)),
        (vk::TimeDomainKHR::CLOCK_MONOTONIC_RAW, || nanoseconds(ClockId::MonotonicRaw)),
    ]
};
#[cfg(not(target_os = "linux"))]
const HOST: [(vk::TimeDomainKHR, fn() -> u64); 0] = [];

/// Lists the host's clocks, and the device's unless it counts the simulated hardware's time.
#[doc(alias = "vkGetPhysicalDeviceCalibrateableTimeDomainsEXT")]
pub(crate) fn get_physical_device_calibrateable_time_domains(
    physical_device: &PhysicalDevice,
) -> Result<Vec<vk::TimeDomainKHR>, Error> {
    let host = HOST.map(|(domain, _)| domain);
    let instance = physical_device.require_instance()?;
    let device = (!instance.options().has_simulated_timestamps()?).then_some(vk::TimeDomainKHR::DEVICE);
    Ok(device.into_iter().chain(host).collect())
}

/// Reads clocks one after another. The greatest deviation is the time from the first to the last, and a nanosecond,
/// which is the unit of all clocks.
///
/// # Safety
/// `timestamps` has a place for each of the infos.
#[doc(alias = "vkGetCalibratedTimestampsEXT")]
pub(crate) unsafe fn get_calibrated_timestamps(
    device: &Device,
    timestamp_infos: &[vk::CalibratedTimestampInfoKHR<'_>],
    timestamps: *mut u64,
    max_deviation: *mut u64,
) -> Result<(), Error> {
    let started = host_time();
    let is_simulated = device.simulated().runtime().config().simulated_timestamps;
    // SAFETY: the caller's promise.
    let places = unsafe { valid::output_slice(timestamps, timestamp_infos.len())? };
    for (info, place) in timestamp_infos.iter().zip(places) {
        let of_host = HOST.iter().find(|(domain, _)| *domain == info.time_domain);
        let time = match of_host {
            Some((_, read)) => read(),
            None if info.time_domain == vk::TimeDomainKHR::DEVICE && !is_simulated => host_time(),
            None => {
                return Err(Error::usage(
                    "VUID-VkCalibratedTimestampInfoEXT-timeDomain-02354",
                    format!("{:?} is none of the device's time domains", info.time_domain),
                ));
            }
        };
        place.write(time);
    }
    // SAFETY: the caller's promise.
    unsafe { valid::output(max_deviation, host_time() - started + 1) }
}
