//! Swapchains of headless surfaces, which need no window system: images are acquired, drawn to and presented as Vulkan
//! requires.

use ash::vk;
use gaurast_testkit::presenter::{Presenter, SIZE, SwapchainOptions};

fn headless() -> Presenter {
    Presenter::new(vulkan_gaurast::entry(), ash::ext::headless_surface::NAME, |entry, instance| {
        let functions = ash::ext::headless_surface::Instance::new(entry, instance);
        // SAFETY: the create info is valid.
        unsafe { functions.create_headless_surface(&Default::default(), None) }.expect("a surface")
    })
}

#[gaurast_runner::test]
fn a_surface_tells_what_it_can() {
    let presenter = headless();
    let can = presenter.capabilities().expect("capabilities");
    assert_eq!(can.current_extent.width, u32::MAX);
    assert_eq!(can.min_image_extent.width, 1);
    assert!(can.max_image_extent.width >= 16384 && can.max_image_count == 0);
    let wanted = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::TRANSFER_SRC
        | vk::ImageUsageFlags::TRANSFER_DST
        | vk::ImageUsageFlags::SAMPLED
        | vk::ImageUsageFlags::INPUT_ATTACHMENT;
    assert!(can.supported_usage_flags.contains(wanted));
    assert_eq!(presenter.formats(), [vk::Format::B8G8R8A8_UNORM, vk::Format::B8G8R8A8_SRGB]);
    assert_eq!(
        presenter.modes(),
        [vk::PresentModeKHR::FIFO, vk::PresentModeKHR::MAILBOX, vk::PresentModeKHR::IMMEDIATE]
    );
}

#[gaurast_runner::test]
fn many_frames_are_presented_in_every_mode() {
    let presenter = headless();
    for mode in presenter.modes() {
        let options = SwapchainOptions { mode, count: 3, ..SwapchainOptions::default() };
        let swapchain = presenter.swapchain(&options).expect("a swapchain");
        assert_eq!(swapchain.images.len(), 3);
        let mut seen = [0; 3];
        for frame in 0..60 {
            let color = [frame as f32 / 60.0, 0.5, 1.0, 1.0];
            let (index, presented) = swapchain.frame(color);
            assert_eq!(presented, Ok(false), "{mode:?}");
            seen[index as usize] += 1;
        }
        assert!(seen.iter().all(|&times| times > 5), "{mode:?}: {seen:?}");
    }
}

/// An image keeps its contents when it is presented, and another image that is bound to its memory has the same
/// contents.
#[gaurast_runner::test]
fn images_hold_what_is_drawn_and_share_their_memory() {
    let presenter = headless();
    let swapchain = presenter.swapchain(&SwapchainOptions::default()).expect("a swapchain");
    let (index, presented) = swapchain.frame([0.2, 0.4, 0.6, 1.0]);
    assert_eq!(presented, Ok(false));
    let expected = [153, 102, 51, 255];
    let pixels = presenter.read(swapchain.images[index as usize]);
    assert_eq!(pixels.len(), (SIZE[0] * SIZE[1]) as usize);
    assert!(pixels.iter().all(|pixel| *pixel == expected));
    let alias = swapchain.alias(index);
    let pixels = presenter.read(alias);
    assert!(pixels.iter().all(|pixel| *pixel == expected));
    presenter.destroy_image(alias);
}

#[gaurast_runner::test]
fn an_acquisition_waits_as_long_as_it_is_told() {
    let presenter = headless();
    let options = SwapchainOptions { count: 2, ..SwapchainOptions::default() };
    let swapchain = presenter.swapchain(&options).expect("a swapchain");
    let first = swapchain.acquire(u64::MAX).expect("an image");
    let second = swapchain.acquire(u64::MAX).expect("another");
    assert_ne!(first.0, second.0);
    assert_eq!(swapchain.acquire(0), Err(vk::Result::NOT_READY));
    assert_eq!(swapchain.acquire(1_000_000), Err(vk::Result::TIMEOUT));
    assert_eq!(swapchain.present(first.0), Ok(false));
    assert_eq!(swapchain.acquire(u64::MAX), Ok((first.0, false)));
}

#[gaurast_runner::test]
fn a_swapchain_takes_the_place_of_another() {
    let presenter = headless();
    let options = SwapchainOptions::default();
    let old = presenter.swapchain(&options).expect("a swapchain");
    assert_eq!(old.frame([1.0; 4]).1, Ok(false));
    let (acquired, _) = old.acquire(u64::MAX).expect("an image");
    assert_eq!(presenter.swapchain(&options).err(), Some(vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR));
    let options = SwapchainOptions { old: old.raw, size: [7, 5], ..options };
    let new = presenter.swapchain(&options).expect("a swapchain");
    assert_eq!(old.acquire(0), Err(vk::Result::ERROR_OUT_OF_DATE_KHR));
    assert_eq!(old.present(acquired), Err(vk::Result::ERROR_OUT_OF_DATE_KHR));
    drop(old);
    assert_eq!(new.frame([0.0; 4]).1, Ok(false));
}

#[gaurast_runner::test]
fn what_is_no_swapchain_is_refused() {
    let presenter = headless();
    let empty = SwapchainOptions { size: [0, 4], ..SwapchainOptions::default() };
    assert_eq!(presenter.swapchain(&empty).err(), Some(vk::Result::ERROR_VALIDATION_FAILED_EXT));
    let swapchain = presenter.swapchain(&SwapchainOptions::default()).expect("one after the one that failed");
    // An image that was not acquired.
    assert_eq!(swapchain.present(0), Err(vk::Result::ERROR_VALIDATION_FAILED_EXT));
}

/// Without a window system, the driver lists no window surface extension.
#[gaurast_runner::test(alone)]
fn windows_are_there_with_their_systems_only() {
    let names = |entry: &ash::Entry| -> Vec<String> {
        // SAFETY: no layer is named.
        let listed = unsafe { entry.enumerate_instance_extension_properties(None) };
        let listed = listed.expect("extensions");
        let names = listed.iter().filter_map(|it| it.extension_name_as_c_str().ok());
        names.map(|name| name.to_string_lossy().into_owned()).collect()
    };
    let has = |names: &[String], name: &str| names.iter().any(|listed| listed == name);
    let bare = names(&vulkan_gaurast::entry());
    assert!(has(&bare, "VK_KHR_surface") && has(&bare, "VK_EXT_headless_surface"));
    let of_systems = ["VK_KHR_xcb_surface", "VK_KHR_xlib_surface", "VK_KHR_wayland_surface"];
    assert!(of_systems.iter().all(|name| !has(&bare, name)));
    let with_windows = names(&gaurast_window::entry());
    assert!(of_systems.iter().all(|name| has(&with_windows, name)));
}
