//! Scenes of several samples per pixel.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{need, simple};
use gaurast_testkit::shapes;
use gaurast_testkit::{Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, depth_test};

fn four() -> TargetOptions {
    TargetOptions::default().multisampled()
}

pub fn four_samples(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions::default();
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(70, 30)))
}

pub fn four_samples_with_depth(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let target = TargetOptions { depth: Some(vk::Format::D32_SFLOAT), ..four() };
    Ok(simple(gpu, &target, &options, &shapes::soup(71, 30)))
}

/// Resolves integers, which take their first sample.
pub fn resolved_integers(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out uvec4 color;
             void main() { color = uvec4(ivec4(gl_FragCoord.xyxy)); }",
        ),
        ..PipelineOptions::default()
    };
    let target = TargetOptions { colors: vec![vk::Format::R8G8B8A8_UINT], ..four() };
    Ok(simple(gpu, &target, &options, &shapes::soup(72, 30)))
}

pub fn resolved_floats(gpu: &Gpu) -> Drawn {
    let target = TargetOptions { colors: vec![vk::Format::R16G16B16A16_SFLOAT, vk::Format::R8G8B8A8_SRGB], ..four() };
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 first;
             layout(location = 1) out vec4 second;
             void main() { first = 10.0 * v_color; second = v_color; }",
        ),
        ..PipelineOptions::default()
    };
    Ok(simple(gpu, &target, &options, &shapes::flat_soup(73, 30)))
}

/// Shades every sample at its own position. It has no perspective, because lavapipe divides by the `w` of the pixel's
/// centre; the test `interpolation` compares perspective with exact values.
pub fn sample_shading(gpu: &Gpu) -> Drawn {
    need("sampleRateShading", gpu.features().sample_rate_shading)?;
    let options = PipelineOptions { sample_shading: Some(1.0), ..PipelineOptions::default() };
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(74, 30)))
}

/// Draws with a shader that reads its sample number and therefore runs for each sample.
pub fn sample_numbers(gpu: &Gpu) -> Drawn {
    need("sampleRateShading", gpu.features().sample_rate_shading)?;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 color = vec4(gl_SamplePosition, float(gl_SampleID) / 4.0, v_color.a);
             }",
        ),
        ..PipelineOptions::default()
    };
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(75, 30)))
}

pub fn sample_qualifier(gpu: &Gpu) -> Drawn {
    need("sampleRateShading", gpu.features().sample_rate_shading)?;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) sample in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = v_color; }",
        ),
        ..PipelineOptions::default()
    };
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(76, 30)))
}

/// Interpolates at centroids. The device chooses the sample that stands for the centroid. Results agree only in pixels
/// that are wholly inside, or if the values are constant; therefore colours vary little.
pub fn centroid_qualifier(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) centroid in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = step(vec4(0.0), v_color); }",
        ),
        ..PipelineOptions::default()
    };
    let mut vertices = shapes::flat_soup(77, 30);
    // The value is zero along one edge and positive elsewhere, so only extrapolation can make it negative.
    for (index, vertex) in vertices.iter_mut().enumerate() {
        vertex.color = [f32::from(index % 3 == 0), 1.0, f32::from(index % 3 == 1), 1.0];
    }
    Ok(simple(gpu, &four(), &options, &vertices))
}

pub fn alpha_to_coverage(gpu: &Gpu) -> Drawn {
    // Alphas far from the values at which one more sample is covered.
    let mut vertices = shapes::flat_soup(78, 30);
    for (index, vertex) in vertices.iter_mut().enumerate() {
        vertex.color[3] = [0.1, 0.35, 0.6, 0.85, 1.0][index / 3 % 5];
    }
    let options = PipelineOptions { alpha_to_coverage: true, ..PipelineOptions::default() };
    Ok(simple(gpu, &four(), &options, &vertices))
}

pub fn alpha_to_one(gpu: &Gpu) -> Drawn {
    need("alphaToOne", gpu.features().alpha_to_one)?;
    let options = PipelineOptions { alpha_to_one: true, ..PipelineOptions::default() };
    Ok(simple(gpu, &four(), &options, &shapes::soup(79, 30)))
}

pub fn sample_mask(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions { sample_mask: 0b0110, ..PipelineOptions::default() };
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(80, 30)))
}

/// Draws with a shader that reads the covered samples and chooses the written ones.
pub fn sample_mask_in_the_shader(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 color = vec4(float(gl_SampleMaskIn[0]) / 15.0, v_color.gba);
                 gl_SampleMask[0] = int(gl_FragCoord.x) & 15;
             }",
        ),
        ..PipelineOptions::default()
    };
    Ok(simple(gpu, &four(), &options, &shapes::flat_soup(81, 30)))
}

/// Loads the samples of a first pass in a second pass.
pub fn samples_loaded_again(gpu: &Gpu) -> Drawn {
    let target = Target::new(gpu, &four());
    let pipeline = Pipeline::new(gpu, &target, &PipelineOptions::default());
    let vertices = Buffer::of(gpu, &shapes::flat_soup(82, 30));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..45);
        });
        commands.pass(&target, &Pass::load(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(45..90);
        });
    });
    Ok(target.output(gpu))
}

/// Draws lines and points to an image of four samples.
pub fn lines_and_points_of_four_samples(gpu: &Gpu) -> Drawn {
    let mut output = gaurast_testkit::Output::default();
    for topology in [vk::PrimitiveTopology::POINT_LIST, vk::PrimitiveTopology::LINE_LIST] {
        let options = PipelineOptions { topology, ..PipelineOptions::default() };
        let drawn = simple(gpu, &four(), &options, &shapes::points(83, 30));
        output.add(&format!("{topology:?}"), drawn);
    }
    Ok(output)
}
