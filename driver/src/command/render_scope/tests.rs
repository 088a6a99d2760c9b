use super::*;
use crate::render_pass::{DepthStencilResolve, Subpass};
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::texture::IDENTITY;
use simdevice::{Allocation, image};

fn view(format: Format, samples: u32) -> Arc<ImageView> {
    let desc = ImageDesc { kind: ImageKind::D2, format, extent: [8, 8, 1], mip_levels: 1, array_layers: 1, samples };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    let image = Arc::new(image::Image::new(desc, memory, 0).unwrap());
    Arc::new(ImageView {
        view: image::ImageView { image, format, base_mip_level: 0, level_count: 1, base_layer: 0, layer_count: 1 },
        aspect: format.aspects()[0],
        swizzle: IDENTITY,
        chroma: None,
    })
}

const DESCRIPTION: AttachmentDescription = AttachmentDescription {
    format: vk::Format::UNDEFINED,
    load: vk::AttachmentLoadOp::CLEAR,
    store: vk::AttachmentStoreOp::DONT_CARE,
    stencil_load: vk::AttachmentLoadOp::CLEAR,
    stencil_store: vk::AttachmentStoreOp::DONT_CARE,
};

fn begun(views: Vec<Arc<ImageView>>, subpasses: Vec<Subpass>) -> RenderPassInstance {
    let render_pass = RenderPass::new(vec![DESCRIPTION; views.len()], subpasses).unwrap();
    RenderPassInstance {
        render_pass: Arc::new(render_pass),
        views,
        clear_values: Vec::new(),
        area: Rect { x: 0, y: 0, width: 8, height: 8 },
        layers: 1,
    }
}

fn rendering(packet: Packet) -> Rendering {
    match packet {
        Packet::BeginRendering(rendering) => *rendering,
        other => panic!("{other:?} begins no pass"),
    }
}

fn is_view(resolve: &AttachmentResolve, view: &ImageView) -> bool {
    Arc::ptr_eq(&resolve.view.image, &view.view.image)
}

const COLOR: Format = Format::R8G8B8A8Unorm;
const DEPTH: Format = Format::D24UnormS8Uint;

#[test]
fn attachments_are_resolved_aspect_by_aspect() {
    let views = vec![view(COLOR, 4), view(COLOR, 1), view(DEPTH, 4), view(DEPTH, 1)];
    let subpass = Subpass {
        color: vec![None, Some(0)],
        resolve: vec![None, Some(1)],
        depth_stencil: Some(2),
        depth_stencil_resolve: Some(DepthStencilResolve {
            attachment: 3,
            depth: None,
            stencil: Some(ResolveMode::Max),
        }),
        ..Subpass::default()
    };
    let packet = begun(views.clone(), vec![subpass]).subpass(0).unwrap();
    let found = rendering(packet);
    let color = found.color[1].as_ref().unwrap().resolve.as_ref().unwrap();
    assert!(is_view(color, &views[1]) && color.mode == ResolveMode::Average);
    assert!(found.depth.unwrap().resolve.is_none());
    let stencil = found.stencil.unwrap().resolve.unwrap();
    assert!(is_view(&stencil, &views[3]) && stencil.mode == ResolveMode::Max);
}

#[test]
fn what_is_resolved_fits_where_it_goes() {
    for target in [view(Format::R8G8B8A8Uint, 1), view(COLOR, 4)] {
        let subpass = Subpass { color: vec![Some(0)], resolve: vec![Some(1)], ..Subpass::default() };
        let pass = begun(vec![view(COLOR, 4), target], vec![subpass]);
        assert!(matches!(pass.subpass(0), Err(Error::InvalidUsage { .. })));
    }
}

#[test]
fn attachments_have_as_many_samples_as_one_another() {
    let with_depth = |samples| {
        let subpass = Subpass { color: vec![None, Some(0)], depth_stencil: Some(1), ..Subpass::default() };
        begun(vec![view(COLOR, 4), view(DEPTH, samples)], vec![subpass]).subpass(0)
    };
    assert!(with_depth(4).is_ok());
    assert!(matches!(with_depth(1), Err(Error::InvalidUsage { .. })));
    let attachment = |samples| DynamicAttachment {
        view: view(COLOR, samples),
        load: vk::AttachmentLoadOp::LOAD,
        store: vk::AttachmentStoreOp::STORE,
        clear_value: vk::ClearValue::default(),
        resolve: None,
        mode: None,
    };
    let two = |samples: [u32; 2]| {
        let dynamic = DynamicRendering {
            layers: 1,
            color: samples.map(|samples| Some(attachment(samples))).to_vec(),
            ..DynamicRendering::default()
        };
        dynamic.packet()
    };
    assert!(two([4, 4]).is_ok());
    assert!(matches!(two([4, 1]), Err(Error::InvalidUsage { .. })));
}

#[test]
fn attachments_that_are_read_first_are_cleared_first() {
    let subpasses = vec![
        Subpass { color: vec![Some(0)], input: vec![Some(1), Some(0)], ..Subpass::default() },
        Subpass { color: vec![Some(1)], ..Subpass::default() },
    ];
    let pass = begun(vec![view(COLOR, 1), view(DEPTH, 1)], subpasses);
    let mut packets = pass.clears_before_reads(0).unwrap().into_iter();
    let cleared = rendering(packets.next().unwrap());
    assert!(cleared.color.iter().all(Option::is_none));
    for attachment in [cleared.depth, cleared.stencil] {
        let attachment = attachment.unwrap();
        assert!(matches!(attachment.load, LoadOp::Clear(_)));
        assert_eq!(attachment.store, StoreOp::Store);
    }
    assert!(matches!(packets.next(), Some(Packet::EndRendering)));
    assert!(packets.next().is_none());
    assert!(pass.clears_before_reads(1).unwrap().is_empty());
}

#[test]
fn suspended_rendering_is_resolved_where_it_ends() {
    let attachment = DynamicAttachment {
        view: view(COLOR, 4),
        load: vk::AttachmentLoadOp::DONT_CARE,
        store: vk::AttachmentStoreOp::DONT_CARE,
        clear_value: vk::ClearValue::default(),
        resolve: Some(ResolveTo { target: view(COLOR, 1), mode: ResolveMode::Average }),
        mode: None,
    };
    let resolves = |flags| {
        let dynamic =
            DynamicRendering { flags, layers: 1, color: vec![Some(attachment.clone())], ..DynamicRendering::default() };
        let found = rendering(dynamic.packet().unwrap());
        found.color[0].as_ref().unwrap().resolve.is_some()
    };
    assert!(resolves(vk::RenderingFlags::empty()));
    assert!(resolves(vk::RenderingFlags::RESUMING));
    assert!(!resolves(vk::RenderingFlags::SUSPENDING));
}
