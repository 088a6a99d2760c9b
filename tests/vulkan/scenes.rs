//! Scenes of all chapters, each named after its subject. Every scene is drawn on this driver, embedded and through the
//! loader, and on lavapipe.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_runner::{Case, Missing, Need, Variant, ignore, require};
use gaurast_testkit::devices::{lavapipe, own};
use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Difference, differences, for_people, write_differences};
use gaurast_testkit::{Gpu, Output};
use gaurast_tests::triangles::Expected;
use gaurast_tests::triangles::models::Model;

use crate::drivers::loaded;

/// A scene: a function that draws it on any device.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Its name.
    pub name: &'static str,
    /// Draws it.
    pub draw: fn(&Gpu) -> Drawn,
}

/// The scene of a name.
pub fn find(name: &str) -> Option<&'static Scene> {
    ALL.iter().find(|scene| scene.name == name)
}

macro_rules! list {
    ($($chapter:ident::$subject:ident: $($name:ident),+;)+) => {
        /// All scenes.
        pub const ALL: &[Scene] = &[
            $($(Scene { name: stringify!($name), draw: crate::$chapter::$subject::$name }),+),+
        ];
    };
}
list! {
    drawing_commands::topology:
        triangle_list, triangle_strip, triangle_fan, provoking_vertices, points, large_points, point_coordinates, line_list, line_strip, wide_lines, indices_of_every_type, base_vertex_and_first_index, primitive_restart, instances_by_number, instances_by_attribute, indirect_draws, indexed_indirect_draws, indirect_count;
    rasterization::polygons:
        culling, front_facing, polygons_as_lines, polygons_as_points, rasterizer_discard, negative_viewport_height, viewport_and_depth_range, scissors, viewport_beyond_the_target, clip_distances, cull_distances, depth_clamp, fragment_coordinates, no_fragment_stage, primitive_numbers, odd_target;
    fragment_operations::depth_stencil:
        depth_comparisons, depth_of_16_bits, depth_of_24_bits, depth_of_24_bits_and_stencil, depth_of_32_bits_and_stencil, depth_without_writes, constant_depth_bias, constant_depth_bias_of_floats, slope_depth_bias, clamped_depth_bias, depth_bounds, written_depth, discarded_fragments, early_fragment_tests, stencil_comparisons, stencil_operations, stencil_write_mask, two_sided_stencil;
    fragment_operations::blending:
        blend_factors, blend_operations, blended_bytes, added_bytes, blended_srgb, separate_alpha, dual_source_blending, write_masks, logic_operations, several_attachments, color_formats, integer_formats, colors_out_of_range;
    rasterization::multisample:
        four_samples, four_samples_with_depth, resolved_integers, resolved_floats, sample_shading, sample_numbers, sample_qualifier, centroid_qualifier, alpha_to_coverage, alpha_to_one, sample_mask, sample_mask_in_the_shader, samples_loaded_again, lines_and_points_of_four_samples;
    shaders::shading:
        smooth_with_perspective, flat_values, noperspective, many_varyings, derivatives, divergent_loops, functions_and_switches, built_in_functions, specialization_constants, vertex_arithmetic;
    samplers::textures:
        nearest_filter, linear_filter, explicit_levels, implicit_levels, trilinear_filter, level_bias_and_limits, address_modes, border_colors, unnormalized_coordinates, texel_fetch, texture_gather, texel_offsets, one_dimension, three_dimensions, array_layers, cube_faces, seamless_cube, cube_arrays, anisotropic_filter, depth_comparison_samplers, texture_formats, integer_textures, textures_in_vertex_shaders;
    resource_descriptors::buffers:
        vertex_formats, float_vertex_formats, vertex_offsets_and_strides, uniform_buffer, dynamic_uniform_buffer, storage_buffer, push_constants, push_constants_between_draws, fragments_write_storage;
    command_buffers::commands:
        dynamic_culling, dynamic_depth_test, dynamic_depth_bias, dynamic_blend_constants, dynamic_topology_and_restart, dynamic_stencil, dynamic_vertex_strides, secondary_command_buffers, clears_within_a_pass, load_and_store, several_pipelines;
    render_pass::pass_objects:
        render_pass_object, input_attachments, resolve_attachments;
    tessellation_and_geometry::geometry_scenes:
        geometry_passes_on, adjacent_vertices, adjacent_vertices_of_indices, strips_of_geometry, invocations_of_geometry, numbers_from_geometry, points_become_quads, interfaces_of_geometry, sizes_and_distances_of_geometry, flat_values_of_strips;
    tessellation_and_geometry::tessellation_scenes:
        tessellated_triangles, tessellated_quads, isolines, tessellated_points, windings_of_patches, domain_origins, curved_patches, pot_of_patches, values_of_patches, discarded_patches, tessellation_and_geometry;
    rasterization::models:
        african_head, african_head_of_four_samples, duck, bunny;
}

/// Draws a scene, or returns the reason for which it cannot be drawn.
fn try_draw(scene: &Scene, gpu: &Gpu) -> Result<Output, String> {
    match catch_unwind(AssertUnwindSafe(|| (scene.draw)(gpu))) {
        Ok(Ok(output)) => Ok(output),
        Ok(Err(missing)) => Err(missing.to_string()),
        Err(panic) => Err(words(&*panic)),
    }
}

fn words(panic: &dyn Any) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string)).unwrap_or_else(|| "a panic".to_owned())
}

/// A variant for each scene.
fn each_scene() -> Vec<Variant> {
    let data = |name| match name {
        "african_head" | "african_head_of_four_samples" => Some(Model::AFRICAN_HEAD),
        "duck" => Some(Model::DUCK),
        "bunny" => Some(Model::BUNNY),
        _ => None,
    };
    let variant = |scene: &Scene| Variant {
        name: scene.name.to_owned(),
        needs: data(scene.name).map(Need::Data).into_iter().collect(),
    };
    ALL.iter().map(variant).collect()
}

/// This driver draws the same bits embedded and through the loader, and the same picture as lavapipe except for the
/// listed differences.
#[gaurast_runner::test(needs = [GLSLANG, Need::VulkanLoader], each = each_scene())]
fn drivers_agree(case: &Case) {
    let scene = find(case.variant()).expect("a scene");
    let ours = try_draw(scene, own());
    assert_same(&ours, &try_draw(scene, loaded()));
    require(Need::Lavapipe);
    let theirs = match (scene.draw)(lavapipe()) {
        Ok(theirs) => theirs,
        Err(missing) => ignore(Missing::Capability, format!("lavapipe: {missing}")),
    };
    assert!(theirs.shows_something(), "the scene is blank on lavapipe");
    show(scene.name, &ours, &theirs);
    let outcome = judge(scene.name, ours, &theirs);
    match (outcome, Expected::read().unsupported(scene.name)) {
        (Ok(()), None) | (Err(_), Some(_)) => {}
        (Ok(()), Some(listed)) => {
            panic!("it is drawn right: take it off the list of what is not supported ({listed})")
        }
        (Err(reason), None) => panic!("{reason}"),
    }
}

/// Checks that both draw the same bits, or that both fail.
fn assert_same(embedded: &Result<Output, String>, loaded: &Result<Output, String>) {
    let (embedded, loaded) = match (embedded, loaded) {
        (Ok(embedded), Ok(loaded)) => (embedded, loaded),
        (Err(_), Err(_)) => return,
        (Err(reason), Ok(_)) => panic!("embedded: {reason}"),
        (Ok(_), Err(reason)) => panic!("loaded: {reason}"),
    };
    assert_eq!(embedded.pictures.len(), loaded.pictures.len());
    for (embedded, loaded) in embedded.pictures.iter().zip(&loaded.pictures) {
        let is_same = embedded.bytes == loaded.bytes;
        assert!(is_same, "{} differs through the loader", embedded.name);
    }
}

/// Writes both pictures to the folder that `GAURAST_TRIANGLE_PICTURES` names, if it is set.
fn show(name: &str, ours: &Result<Output, String>, theirs: &Output) {
    let Some(folder) = std::env::var_os("GAURAST_TRIANGLE_PICTURES") else {
        return;
    };
    for (who, output) in [("own", ours.as_ref().ok()), ("lavapipe", Some(theirs))] {
        for picture in output.iter().flat_map(|output| &output.pictures) {
            let file = format!("{name}-{}-{who}.png", picture.name.replace(' ', "_"));
            let path = Path::new(&folder).join(file);
            for_people(picture).save(&path).expect("a picture is written");
        }
    }
}

/// Compares this driver's pictures with lavapipe's. The error describes the differences that no exception permits.
fn judge(name: &str, ours: Result<Output, String>, theirs: &Output) -> Result<(), String> {
    let ours = ours?;
    let found = differences(&ours, theirs);
    let expected = Expected::read();
    let is_excused =
        |difference: &Difference| (expected.exceptions(name)).any(|exception| exception.excuses(difference));
    let inexcusable: Vec<_> = (found.into_iter()).filter(|difference| !is_excused(difference)).collect();
    if inexcusable.is_empty() {
        return Ok(());
    }
    let folder = std::env::temp_dir().join("gaurast-differences").join(name);
    let pictures = match write_differences(&folder, &ours, theirs, &inexcusable) {
        Ok(paths) => format!("see {paths:?}"),
        Err(error) => error.to_string(),
    };
    let lines: Vec<_> = inexcusable.iter().map(ToString::to_string).collect();
    Err(format!("{}\n{pictures}", lines.join("\n")))
}

#[gaurast_runner::test]
fn every_listed_name_is_that_of_a_scene() {
    let expected = Expected::read();
    let unknown: Vec<_> = expected.names().filter(|name| find(name).is_none()).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}
