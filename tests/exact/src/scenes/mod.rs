//! Scenes of points, lines and triangles, each named after its subject: functions that draw on any device. A file is a subject
//! of a chapter of the Vulkan specification.

mod blending;
mod buffers;
mod commands;
mod depth_stencil;
mod geometry;
mod multisample;
mod pass_objects;
mod polygons;
mod shading;
mod tessellation;
mod textures;
mod topology;

use gaurast_testkit::Gpu;
use gaurast_testkit::drawn::Drawn;

/// A scene: a function that draws it on any device.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The chapter of the Vulkan specification, as the folders of its tests are named.
    pub chapter: &'static str,
    /// The name.
    pub name: &'static str,
    /// Draws it.
    pub draw: fn(&Gpu) -> Drawn,
}

macro_rules! list {
    ($($chapter:ident::$subject:ident: $($name:ident),+;)+) => {
        /// All scenes.
        pub const ALL: &[Scene] = &[
            $($(Scene { chapter: stringify!($chapter), name: stringify!($name), draw: $subject::$name }),+),+
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
    tessellation_and_geometry::geometry:
        geometry_passes_on, adjacent_vertices, adjacent_vertices_of_indices, strips_of_geometry, invocations_of_geometry, numbers_from_geometry, points_become_quads, interfaces_of_geometry, sizes_and_distances_of_geometry, flat_values_of_strips;
    tessellation_and_geometry::tessellation:
        tessellated_triangles, tessellated_quads, isolines, tessellated_points, windings_of_patches, domain_origins, curved_patches, pot_of_patches, values_of_patches, discarded_patches, tessellation_and_geometry;
}
