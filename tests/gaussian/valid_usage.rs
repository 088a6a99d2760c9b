//! The extension's valid usage: each statement of the specification is violated once, and the message must have its id.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST,
    GaussianCameraSourceGAURAST, GaussianCutOffGAURAST, GaussianDecodingGAURAST, GaussianDistortionModelGAURAST,
    GaussianGeometryGAURAST, GaussianHarmonicsDecodingGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST, GaussianRotationDecodingGAURAST,
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST, PipelineGaussianApproximationStateCreateInfoGAURAST,
    PipelineGaussianDecodingStateCreateInfoGAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use gaurast_runner::Case;
use gaurast_testkit::devices::{gaussian, open, with_features_of_gaussians, without_modes};
use gaurast_testkit::scene::{Scene, camera, splat, splats};
use gaurast_testkit::settings::strictly;
use gaurast_testkit::{Gpu, Graphics, Shader};
use std::collections::BTreeSet;

const SPECIFICATION: &str = include_str!("../../api/spec/VK_GAURAST_gaussian_primitive_topology.adoc");

/// The statements that the registry implies.
const IMPLICIT: &str = include_str!("../../api/spec/implicit_valid_usage.adoc");

/// The ids of a text's statements.
fn ids(text: &str) -> impl Iterator<Item = &str> {
    let is_of_id = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let candidates = text.split(move |c: char| !is_of_id(c));
    candidates.filter(|id| id.starts_with("VUID-"))
}

/// The ids of the specification's statements.
fn stated() -> BTreeSet<&'static str> {
    ids(SPECIFICATION).collect()
}

#[gaurast_runner::test]
fn statements_have_anchors_and_numbers_of_their_own() {
    let mut numbers = BTreeSet::new();
    for id in stated() {
        let (_, number) = id.rsplit_once('-').unwrap();
        assert!(number.parse::<u32>().is_ok(), "{id} has no number");
        assert!(numbers.insert(number), "the number of {id} is another's");
        let anchor = format!("[[{id}]] *{id}*");
        assert_eq!(SPECIFICATION.matches(&anchor).count(), 1, "{anchor}");
    }
    let implied: Vec<_> = ids(IMPLICIT).collect();
    let different: BTreeSet<_> = implied.iter().collect();
    // Once in its anchor, and once in its name.
    assert_eq!(implied.len(), 2 * different.len());
}

#[gaurast_runner::test]
fn every_structure_and_command_has_its_implied_statements() {
    for id in [
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sType-sType",
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-flags-parameter",
        "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-parameter",
        "VUID-VkGaussianCameraGAURAST-pNext-pNext",
        "VUID-VkGaussianCameraGAURAST-model-parameter",
        "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-parameter",
        "VUID-VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST-gaussianCutOff-parameter",
        "VUID-vkCmdSetGaussianCamerasGAURAST-pCameras-parameter",
        "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-arraylength",
        "VUID-vkCmdEndGaussianSetGAURAST-renderpass",
        "VUID-vkCmdSetGaussianOrderGAURAST-commandBuffer-recording",
        "VUID-vkCmdSetGaussianOrderGAURAST-commandBuffer-cmdpool",
    ] {
        assert!(ids(IMPLICIT).any(|implied| implied == id), "{id}");
    }
    let returned = "VUID-VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST";
    let of_returned = ids(IMPLICIT).filter(|id| id.starts_with(returned));
    let of_returned: Vec<_> = of_returned.collect();
    assert!(!of_returned.is_empty());
    assert!(of_returned.iter().all(|id| id.ends_with("-sType")));
}

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

fn with(change: impl FnOnce(State) -> State) -> Graphics<'static> {
    let request = splats();
    Graphics { gaussian: request.gaussian.map(change), ..request }
}

fn allowing(exponential_error: f32, contribution_budget: f32) -> Graphics<'static> {
    let approximation = PipelineGaussianApproximationStateCreateInfoGAURAST::default()
        .exponential_error(exponential_error)
        .contribution_budget(contribution_budget);
    Graphics { approximation: Some(approximation), ..splats() }
}

fn within(cut_off: GaussianCutOffGAURAST, deviations: f32, floor: f32) -> Graphics<'static> {
    let footprint = PipelineGaussianFootprintStateCreateInfoGAURAST::default()
        .cut_off(cut_off)
        .cut_off_deviations(deviations)
        .compensation_floor(floor);
    Graphics { footprint: Some(footprint), ..splats() }
}

/// A pipeline of the unscented transform with other sigma points.
fn pointing(
    change: impl FnOnce(
        PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>,
    ) -> PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>,
) -> Graphics<'static> {
    let unscented = change(PipelineGaussianUnscentedStateCreateInfoGAURAST::default());
    Graphics { unscented: Some(unscented), ..with(|s| s.linearization(GaussianLinearizationGAURAST::UNSCENTED)) }
}

type Decoding = PipelineGaussianDecodingStateCreateInfoGAURAST<'static>;

/// A pipeline with decodings, whose attribute at a location has a format.
fn decoded(location: u32, format: vk::Format, change: impl FnOnce(Decoding) -> Decoding) -> Graphics<'static> {
    let mut request = splats();
    let attributes = request.attributes.iter_mut().filter(|attribute| attribute.location == location);
    attributes.for_each(|attribute| attribute.format = format);
    Graphics { decoding: Some(change(Decoding::default())), ..request }
}

/// Pipelines that break one statement each.
fn pipelines() -> Vec<(&'static str, Graphics<'static>)> {
    let missing = |index: usize| {
        let mut request = splats();
        request.attributes.truncate(index);
        request
    };
    let buffer = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
    vec![
        (
            "VUID-VkGraphicsPipelineCreateInfo-rasterizerDiscardEnable-90080",
            Graphics { raster: splats().raster.rasterizer_discard_enable(true), ..splats() },
        ),
        ("VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-alpha-90091", pointing(|p| p.alpha(0.0))),
        ("VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-beta-90092", pointing(|p| p.beta(f32::NAN))),
        ("VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-kappa-90093", pointing(|p| p.kappa(-3.0))),
        (
            "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-pictureMargin-90094",
            pointing(|p| p.picture_margin(-0.5)),
        ),
        (
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-90096",
            decoded(0, vk::Format::R32G32B32_SFLOAT, |d| d.position(GaussianDecodingGAURAST::CHUNK)),
        ),
        (
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-90096",
            decoded(3, vk::Format::R16_UINT, |d| d.opacity(GaussianDecodingGAURAST::CODEBOOK)),
        ),
        (
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-90097",
            decoded(2, vk::Format::R32_UINT, |d| d.rotation(GaussianRotationDecodingGAURAST::SMALLEST_THREE_8)),
        ),
        (
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-90098",
            Graphics {
                decoding: Some(Decoding::default().spherical_harmonics(GaussianHarmonicsDecodingGAURAST::CODEBOOK)),
                ..with(|s| s.flags(PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER))
            },
        ),
        ("VUID-VkGraphicsPipelineCreateInfo-viewportCount-90081", Graphics { viewports: 2, ..splats() }),
        (
            "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-90082",
            splats().with_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE),
        ),
        ("VUID-VkGraphicsPipelineCreateInfo-topology-90007", Graphics { gaussian: None, ..splats() }),
        ("VUID-VkPipelineInputAssemblyStateCreateInfo-topology-90009", Graphics { restart: true, ..splats() }),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-order-parameter",
            with(|s| s.order(GaussianOrderGAURAST::from_raw(77))),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-parameter",
            with(|s| s.geometry(GaussianGeometryGAURAST::from_raw(77))),
        ),
        (
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-parameter",
            within(GaussianCutOffGAURAST::from_raw(77), 3.0, 0.0),
        ),
        (
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOffDeviations-90076",
            within(GaussianCutOffGAURAST::ELLIPSE, 0.0, 0.0),
        ),
        (
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-compensationFloor-90077",
            within(GaussianCutOffGAURAST::NONE, 0.0, 1.5),
        ),
        (
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-90078",
            Graphics {
                footprint: within(GaussianCutOffGAURAST::TILE_SQUARE, 3.0, 0.0).footprint,
                ..with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D))
            },
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsDegree-90010",
            with(|s| s.spherical_harmonics_degree(9)),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-lowPassVariance-90011",
            with(|s| s.low_pass_variance(f32::NAN)),
        ),
        ("VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaFloor-90012", with(|s| s.alpha_floor(-1.0))),
        ("VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-90013", with(|s| s.alpha_ceiling(0.0))),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-transmittanceFloor-90014",
            with(|s| s.transmittance_floor(1.0)),
        ),
        ("VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-90051", allowing(-0.1, 0.0)),
        (
            "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-90052",
            allowing(0.0, f32::NAN),
        ),
        ("VUID-VkGaussianAttributeLocationsGAURAST-None-90015", missing(2)),
        (
            "VUID-VkGaussianAttributeLocationsGAURAST-None-90019",
            with(|s| s.attribute_locations(s.attribute_locations.model_opacity(0))),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-firstModelMatrix-90028",
            with(|s| {
                s.order(GaussianOrderGAURAST::PER_PIXEL)
                    .attribute_locations(s.attribute_locations.first_model_matrix(0))
            }),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90029",
            with(|s| {
                s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D).linearization(GaussianLinearizationGAURAST::UNSCENTED)
            }),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90027",
            with(|s| {
                s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)
                    .antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED)
            }),
        ),
        (
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-90030",
            with(|s| s.precision(GaussianPrecisionGAURAST::FLOAT16).order(GaussianOrderGAURAST::PER_PIXEL)),
        ),
        ("VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025", with(|s| s.camera_source(buffer))),
    ]
}

/// Pipelines that use one mode each, on a device on which no mode is enabled.
fn modes() -> Vec<(&'static str, Graphics<'static>)> {
    let buffer = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
    let compensated = GaussianAntialiasingGAURAST::OPACITY_COMPENSATED;
    vec![
        ("vertexShaderProjection", with(|s| s.projection_mode(GaussianProjectionModeGAURAST::VERTEX_SHADER))),
        ("radialDistanceOrder", with(|s| s.order(GaussianOrderGAURAST::RADIAL_DISTANCE))),
        ("primitiveOrder", with(|s| s.order(GaussianOrderGAURAST::PRIMITIVE))),
        ("perPixelOrder", with(|s| s.order(GaussianOrderGAURAST::PER_PIXEL))),
        ("rasterizationFloat16", with(|s| s.precision(GaussianPrecisionGAURAST::FLOAT16))),
        ("opacityCompensation", with(|s| s.antialiasing(compensated))),
        ("unscentedProjection", with(|s| s.linearization(GaussianLinearizationGAURAST::UNSCENTED))),
        ("gaussian2D", with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D))),
        ("uniformBufferCamera", with(|s| s.camera_source(buffer))),
        ("gaussianApproximation", allowing(1e-3, 0.0)),
        ("gaussianCutOff", within(GaussianCutOffGAURAST::ELLIPSE, 3.0, 0.0)),
        ("opacityCompensationFloor", within(GaussianCutOffGAURAST::NONE, 0.0, 0.5)),
        ("resolveGaussianIndices", naming_gaussians()),
        ("attributeActivation", with(|s| s.flags(PipelineGaussianStateCreateFlagsGAURAST::LOG_SCALE))),
        (
            "sphericalHarmonicsBuffer",
            with(|s| s.flags(PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER)),
        ),
        (
            "attributeDecoding",
            decoded(2, vk::Format::R32_UINT, |d| d.rotation(GaussianRotationDecodingGAURAST::SMALLEST_THREE_10)),
        ),
        (
            "gaussianDynamicState",
            Graphics { dynamic: vec![gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST], ..splats() },
        ),
        ("gaussianMultiview", Graphics { view_mask: 1, ..splats() }),
        ("gaussianInstancing", with(|s| s.attribute_locations(s.attribute_locations.first_model_matrix(9)))),
        (
            "gaussianDepthStencil",
            Graphics {
                depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true),
                depth_format: vk::Format::D32_SFLOAT,
                ..splats()
            },
        ),
        (
            "gaussianMultisample",
            Graphics {
                multisample: vk::PipelineMultisampleStateCreateInfo::default()
                    .rasterization_samples(vk::SampleCountFlags::TYPE_4),
                ..splats()
            },
        ),
    ]
}

/// Cameras that violate one statement each.
fn cameras() -> Vec<(&'static str, GaussianCameraGAURAST<'static>)> {
    let nan = f32::NAN;
    vec![
        ("VUID-VkGaussianCameraGAURAST-model-parameter", camera().model(GaussianCameraModelGAURAST::from_raw(77))),
        ("VUID-VkGaussianCameraGAURAST-rotation-90064", camera().rotation([nan; 9])),
        ("VUID-VkGaussianCameraGAURAST-eye-90065", camera().eye([f64::INFINITY; 3])),
        ("VUID-VkGaussianCameraGAURAST-principalPoint-90066", camera().principal_point([nan, 0.0])),
        ("VUID-VkGaussianCameraGAURAST-depthCoefficients-90067", camera().depth_coefficients([0.0, nan])),
        ("VUID-VkGaussianCameraGAURAST-focalLength-90068", camera().focal_length([0.0, 1.0])),
        ("VUID-VkGaussianCameraGAURAST-nearPlane-90069", camera().near_plane(0.0)),
        ("VUID-VkGaussianCameraGAURAST-farPlane-90070", camera().far_plane(0.1)),
    ]
}

/// Cameras whose lenses violate one statement each.
fn lenses() -> Vec<(&'static str, GaussianCameraModelGAURAST, GaussianCameraDistortionGAURAST<'static>)> {
    let pinhole = GaussianCameraModelGAURAST::PINHOLE;
    let lens = |model| GaussianCameraDistortionGAURAST::default().model(model);
    let barrel = lens(GaussianDistortionModelGAURAST::POLYNOMIAL).radial([-0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let field_of_view = lens(GaussianDistortionModelGAURAST::FIELD_OF_VIEW);
    vec![
        (
            "VUID-VkGaussianCameraDistortionGAURAST-model-parameter",
            pinhole,
            lens(GaussianDistortionModelGAURAST::from_raw(77)),
        ),
        ("VUID-VkGaussianCameraDistortionGAURAST-model-90085", GaussianCameraModelGAURAST::ORTHOGRAPHIC, barrel),
        ("VUID-VkGaussianCameraDistortionGAURAST-radial-90086", pinhole, barrel.tangential([f32::NAN, 0.0])),
        (
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90087",
            pinhole,
            field_of_view.radial([0.5, 0.1, 0.0, 0.0, 0.0, 0.0]),
        ),
        (
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90088",
            pinhole,
            field_of_view.radial([4.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ),
    ]
}

/// Creates the pipeline, which must fail, and returns the messages.
fn refused(gpu: &Gpu, request: &Graphics<'_>, result: vk::Result, what: &str) -> String {
    let error = request.create(gpu).expect_err(what);
    assert_eq!(error, result, "{what}");
    gpu.message_texts().concat()
}

#[gaurast_runner::test]
fn every_statement_is_reported_by_its_id(case: &Case) {
    strictly(case, report_every_statement);
}

fn report_every_statement() {
    let mut tested = BTreeSet::new();
    let mut heard = |id: &'static str, messages: String| {
        assert!(messages.contains(&format!("({id})")), "{id}: {messages:?}");
        tested.insert(id);
    };
    let gpu = open();
    let invalid = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    for (id, request) in pipelines() {
        heard(id, refused(&gpu, &request, invalid, id));
    }
    heard("VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008", with_a_vertex_stage(&gpu));
    for (id, messages) in crate::shaders::broken() {
        heard(id, messages);
    }
    for (id, messages) in crate::viewer_usage::broken() {
        heard(id, messages);
    }
    for (id, camera) in cameras() {
        let recorded = gpu.try_record(|recording| {
            let (_, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { gaussian(&gpu).cmd_set_gaussian_cameras(commands, &[camera]) };
        });
        assert_eq!(recorded.unwrap_err(), invalid, "{id}");
        heard(id, gpu.message_texts().concat());
    }
    for (id, model, mut lens) in lenses() {
        let camera = camera().model(model).push_next(&mut lens);
        let recorded = gpu.try_record(|recording| {
            let (_, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { gaussian(&gpu).cmd_set_gaussian_cameras(commands, &[camera]) };
        });
        assert_eq!(recorded.unwrap_err(), invalid, "{id}");
        heard(id, gpu.message_texts().concat());
    }
    let flat = with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D));
    heard("VUID-vkCmdDraw-None-90089", through_a_lens(open(), &flat));
    heard(
        "VUID-VkGaussianCameraDistortionGAURAST-gaussianDistortion-90084",
        through_a_lens(without_modes(), &splats()),
    );
    heard("VUID-vkCmdDraw-geometry-90071", flat_through_a_fisheye());
    heard("VUID-vkCmdDraw-maxGaussiansPerDraw-90083", too_many());
    let bare = without_modes();
    let absent = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    let stated = stated();
    let of_feature = |feature: &str| {
        let id = format!("VUID-VkPipelineGaussianStateCreateInfoGAURAST-{feature}-");
        let found = stated.iter().find(|stated| stated.starts_with(&id));
        *found.unwrap_or_else(|| panic!("no statement is of {feature}"))
    };
    for (feature, request) in modes() {
        heard(of_feature(feature), refused(&bare, &request, absent, feature));
    }
    let features = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
    let unscented = with_features_of_gaussians(features.gaussian_primitive_topology(true).unscented_projection(true));
    let other_points = pointing(|points| points.alpha(0.5));
    let flat =
        with_features_of_gaussians(features.gaussian_primitive_topology(true).gaussian_2d(true).gaussian_cut_off(true));
    let cut_disc = Graphics {
        gaussian: with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)).gaussian,
        ..within(GaussianCutOffGAURAST::TILE_RECTANGLE, 3.33, 0.0)
    };
    heard(of_feature("gaussian2DCutOff"), refused(&flat, &cut_disc, absent, "a cut-off of discs"));
    heard(of_feature("unscentedParameters"), refused(&unscented, &other_points, absent, "other sigma points"));
    heard(of_feature("resolveFragmentShader"), with_a_fragment_stage(&bare));
    heard(of_feature("gaussianPrimitiveTopology"), without_the_topology());
    // [`a_camera_whose_feature_is_not_enabled_draws_nothing_and_says_so`] breaks this one.
    tested.insert("VUID-VkGaussianCameraGAURAST-model-90079");
    let untested: Vec<_> = stated.difference(&tested).collect();
    assert!(untested.is_empty(), "no test breaks {untested:?}");
}

/// The messages of a draw of more Gaussians than there may be, which draws nothing.
fn too_many() -> String {
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])], &splats());
    let pixels = scene.draw([0.25; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, (1 << 26) + 1, 0, 0) };
    });
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    scene.gpu.message_texts().concat()
}

/// The messages of a draw through a lens that distorts, which draws nothing.
fn through_a_lens(gpu: Gpu, request: &Graphics<'static>) -> String {
    let scene = Scene::on(gpu, &[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])], request);
    let pixels = scene.draw([0.25; 4], |device, commands| {
        let mut lens = GaussianCameraDistortionGAURAST::default().radial([-0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let camera = camera().push_next(&mut lens);
        // SAFETY: see the crate.
        unsafe {
            gaussian(&scene.gpu).cmd_set_gaussian_cameras(commands, &[camera]);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    });
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    scene.gpu.message_texts().concat()
}

/// The messages of a draw of 2D Gaussians through a fisheye, which draws nothing.
fn flat_through_a_fisheye() -> String {
    let scene = Scene::new(
        &[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])],
        &with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)),
    );
    let pixels = scene.draw([0.25; 4], |device, commands| {
        let fisheye = camera().model(GaussianCameraModelGAURAST::FISHEYE);
        // SAFETY: see the crate.
        unsafe {
            (gaussian(&scene.gpu)).cmd_set_gaussian_cameras(commands, &[fisheye]);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    });
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    scene.gpu.message_texts().concat()
}

/// A pipeline whose fragment stage reads which Gaussians there are.
fn naming_gaussians() -> Graphics<'static> {
    let code = vec![0x0723_0203, 0x0001_0000, 0, 1, 0];
    Graphics {
        shaders: vec![Shader::new(vk::ShaderStageFlags::FRAGMENT, code)],
        ..with(|s| s.resolve_input_locations(s.resolve_input_locations.nearest_gaussian(3)))
    }
}

/// The messages when a pipeline has a stage.
fn with_a_stage(gpu: &Gpu, stage: vk::ShaderStageFlags, result: vk::Result) -> String {
    let code = vec![0x0723_0203, 0x0001_0000, 0, 1, 0];
    let request = Graphics { shaders: vec![Shader::new(stage, code)], ..splats() };
    refused(gpu, &request, result, "a stage")
}

fn with_a_vertex_stage(gpu: &Gpu) -> String {
    let result = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    with_a_stage(gpu, vk::ShaderStageFlags::VERTEX, result)
}

fn with_a_fragment_stage(gpu: &Gpu) -> String {
    let result = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    with_a_stage(gpu, vk::ShaderStageFlags::FRAGMENT, result)
}

fn without_the_topology() -> String {
    let gpu = gaurast_testkit::devices::without_the_topology();
    let result = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    refused(&gpu, &splats(), result, "the topology")
}

#[gaurast_runner::test]
fn a_camera_whose_feature_is_not_enabled_draws_nothing_and_says_so(case: &Case) {
    strictly(case, draw_through_cameras_that_are_not_enabled);
}

fn draw_through_cameras_that_are_not_enabled() {
    let scene = Scene::on(without_modes(), &[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])], &splats());
    for model in [
        GaussianCameraModelGAURAST::ORTHOGRAPHIC,
        GaussianCameraModelGAURAST::FISHEYE,
        GaussianCameraModelGAURAST::EQUIRECTANGULAR,
    ] {
        let pixels = scene.draw([0.25; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                let gaussian = gaussian(&scene.gpu);
                gaussian.cmd_set_gaussian_cameras(commands, &[camera().model(model)]);
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
        });
        assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
        let messages = scene.gpu.message_texts().concat();
        let id = "VUID-VkGaussianCameraGAURAST-model-90079";
        assert!(messages.contains(id), "{messages:?}");
    }
}

/// Modes that are not enabled draw what they draw where they are, each with one warning.
#[gaurast_runner::test]
fn modes_that_are_not_enabled_draw_the_same() {
    let request = with(|s| s.order(GaussianOrderGAURAST::RADIAL_DISTANCE));
    let dynamic = request.with_dynamic(gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST);
    let splats = [splat([0.0, 0.0, 5.0], 0.5, 0.8, [0.5, 0.2, 0.1]), splat([1.0, 0.0, 4.9], 0.5, 0.6, [0.1, 0.9, 0.3])];
    let draw = |gpu: Gpu| {
        let scene = Scene::on(gpu, &splats, &dynamic);
        let pixels = scene.draw([0.25; 4], |device, commands| {
            let extension = gaussian(&scene.gpu);
            // SAFETY: see the crate.
            unsafe {
                extension.cmd_set_gaussian_cameras(commands, &[camera().model(GaussianCameraModelGAURAST::FISHEYE)]);
                extension.cmd_set_gaussian_order(commands, GaussianOrderGAURAST::PRIMITIVE);
                extension.cmd_begin_gaussian_set(commands);
                device.cmd_draw(commands, 1, 1, 0, 0);
                device.cmd_draw(commands, 1, 1, 1, 0);
                extension.cmd_end_gaussian_set(commands);
            }
        });
        (pixels, scene.gpu.messages())
    };
    let (expected, nothing) = draw(open());
    assert!(nothing.is_empty() && expected.iter().any(|pixel| *pixel != [0.25; 4]), "{nothing:?}");
    let (drawn, mut warnings) = draw(without_modes());
    assert!(drawn == expected);
    warnings.sort_by(|a, b| a.id.cmp(&b.id));
    let ids: Vec<_> = warnings.iter().map(|warning| warning.id.as_str()).collect();
    assert_eq!(
        ids,
        [
            "VUID-VkGaussianCameraGAURAST-model-90079",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDynamicState-90048",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-primitiveOrder-90036",
            "VUID-vkCmdBeginGaussianSetGAURAST-mergedDraws-90001",
        ]
    );
}
