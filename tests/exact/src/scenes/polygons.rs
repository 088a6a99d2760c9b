//! Scenes of culling, faces, polygon modes, viewports, scissors, clipping.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, simple, with};
use gaurast_testkit::shapes;
use gaurast_testkit::{FRAGMENT, Gpu, PipelineOptions, TargetOptions, depth_test};

/// Culls each face, for each winding of front faces.
pub fn culling(gpu: &Gpu) -> Drawn {
    let modes =
        [vk::CullModeFlags::NONE, vk::CullModeFlags::FRONT, vk::CullModeFlags::BACK, vk::CullModeFlags::FRONT_AND_BACK];
    let fronts = [vk::FrontFace::CLOCKWISE, vk::FrontFace::COUNTER_CLOCKWISE];
    let all = modes.into_iter().flat_map(|mode| fronts.map(|front| (mode, front)));
    let name = |&(mode, front): &_| format!("{mode:?} {front:?}");
    Ok(cases(all, name, |&(mode, front)| {
        let raster = PipelineOptions::default().raster;
        let options =
            PipelineOptions { raster: raster.cull_mode(mode).front_face(front), ..PipelineOptions::default() };
        simple(gpu, &TargetOptions::default(), &options, &shapes::soup(20, 40))
    }))
}

pub fn front_facing(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = gl_FrontFacing ? v_color : vec4(1.0) - v_color; }",
        ),
        ..PipelineOptions::default()
    };
    let vertices = shapes::soup(21, 40);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

fn polygon_mode(gpu: &Gpu, mode: vk::PolygonMode) -> Drawn {
    need("fillModeNonSolid", gpu.features().fill_mode_non_solid)?;
    let options =
        PipelineOptions { raster: PipelineOptions::default().raster.polygon_mode(mode), ..PipelineOptions::default() };
    let vertices = shapes::soup(22, 12);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

pub fn polygons_as_lines(gpu: &Gpu) -> Drawn {
    polygon_mode(gpu, vk::PolygonMode::LINE)
}

pub fn polygons_as_points(gpu: &Gpu) -> Drawn {
    polygon_mode(gpu, vk::PolygonMode::POINT)
}

pub fn rasterizer_discard(gpu: &Gpu) -> Drawn {
    let vertices = shapes::soup(23, 20);
    let name = |discard: &bool| format!("discard {discard}");
    Ok(cases([false, true], name, |&discard| {
        let raster = PipelineOptions::default().raster;
        let options =
            PipelineOptions { raster: raster.rasterizer_discard_enable(discard), ..PipelineOptions::default() };
        simple(gpu, &TargetOptions::default(), &options, &vertices)
    }))
}

/// Uses a viewport with negative height, which flips y and with it the winding.
pub fn negative_viewport_height(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        raster: PipelineOptions::default().raster.cull_mode(vk::CullModeFlags::BACK),
        ..PipelineOptions::default()
    };
    let vertices = shapes::soup(24, 30);
    Ok(with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
        commands.viewport([0.0, 128.0, 128.0, -128.0], [0.0, 1.0]);
        commands.draw(0..90);
    }))
}

pub fn viewport_and_depth_range(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let target = TargetOptions::with_depth(vk::Format::D32_SFLOAT);
    Ok(with(gpu, &target, &options, &shapes::soup(25, 30), |commands| {
        commands.viewport([3.25, 7.5, 61.0, 90.75], [0.25, 0.5]);
        commands.draw(0..45);
        commands.viewport([60.0, 10.0, 64.0, 100.0], [0.9, 0.1]);
        commands.draw(45..90);
    }))
}

pub fn scissors(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions::default();
    let vertices = shapes::soup(26, 30);
    Ok(with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
        commands.scissor([5, 9], [50, 21]);
        commands.draw(0..30);
        commands.scissor([64, 64], [0, 10]);
        commands.draw(0..90);
        commands.scissor([71, 33], [1000, 1]);
        commands.draw(0..90);
        commands.scissor([63, 63], [3, 60]);
        commands.draw(30..90);
    }))
}

/// Uses a viewport that extends far beyond the target on all sides.
pub fn viewport_beyond_the_target(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions::default();
    let vertices = shapes::flat_soup(27, 30);
    Ok(with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
        commands.viewport([-100.0, -64.0, 328.0, 256.0], [0.0, 1.0]);
        commands.draw(0..90);
    }))
}

/// Draws with clip or cull distances, which cut triangles or remove those wholly outside.
fn distances(gpu: &Gpu, name: &str) -> Drawn {
    let vertex = format!(
        "layout(location = 0) in vec4 position;
         layout(location = 1) in vec4 color;
         layout(location = 0) out vec4 v_color;
         out float {name}[2];
         void main() {{
             gl_Position = position;
             v_color = color;
             {name}[0] = position.x + 0.3 * position.w;
             {name}[1] = position.y - position.x + 0.4 * position.w;
         }}"
    );
    let options = PipelineOptions { vertex: &vertex, ..PipelineOptions::default() };
    let vertices = shapes::soup(28, 30);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

pub fn clip_distances(gpu: &Gpu) -> Drawn {
    need("shaderClipDistance", gpu.features().shader_clip_distance)?;
    distances(gpu, "gl_ClipDistance")
}

pub fn cull_distances(gpu: &Gpu) -> Drawn {
    need("shaderCullDistance", gpu.features().shader_cull_distance)?;
    distances(gpu, "gl_CullDistance")
}

/// Draws triangles beyond the near and far planes, clipped or clamped.
pub fn depth_clamp(gpu: &Gpu) -> Drawn {
    need("depthClamp", gpu.features().depth_clamp)?;
    // Depths from -0.5 to 1.5 across each triangle. No edge at a plane runs through a pixel centre.
    let mut vertices = shapes::flat_soup(29, 20);
    for vertex in &mut vertices {
        vertex.position[2] = 2.0 * vertex.position[2] - 0.5;
    }
    let options = PipelineOptions {
        raster: PipelineOptions::default().raster.depth_clamp_enable(true),
        depth_stencil: depth_test(vk::CompareOp::LESS_OR_EQUAL),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(vk::Format::D32_SFLOAT);
    Ok(with(gpu, &target, &options, &vertices, |commands| {
        commands.viewport([0.0, 0.0, 128.0, 128.0], [0.2, 0.8]);
        commands.draw(0..60);
    }))
}

/// Writes the fragment coordinates as colours.
pub fn fragment_coordinates(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = gl_FragCoord; }",
        ),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
    Ok(simple(gpu, &target, &options, &shapes::soup(30, 30)))
}

/// Draws with a pipeline without fragment shader.
pub fn no_fragment_stage(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: None,
        depth_stencil: depth_test(vk::CompareOp::LESS),
        ..PipelineOptions::default()
    };
    let target = TargetOptions { colors: Vec::new(), ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) };
    Ok(simple(gpu, &target, &options, &shapes::soup(31, 30)))
}

pub fn primitive_numbers(gpu: &Gpu) -> Drawn {
    need("geometryShader", gpu.features().geometry_shader)?;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out uint number;
             void main() { number = gl_PrimitiveID + 1; }",
        ),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::of(vk::Format::R32_UINT);
    Ok(simple(gpu, &target, &options, &shapes::soup(32, 30)))
}

/// Draws triangles that touch the borders of a target of odd size.
pub fn odd_target(gpu: &Gpu) -> Drawn {
    let target = TargetOptions { size: [77, 41], ..TargetOptions::default() };
    let options = PipelineOptions { fragment: Some(FRAGMENT), ..PipelineOptions::default() };
    let mut vertices = shapes::whole(0.5, [0.2, 0.4, 0.8, 1.0]);
    vertices.extend(shapes::flat_soup(33, 20));
    Ok(simple(gpu, &target, &options, &vertices))
}
