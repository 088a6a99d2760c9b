// A triangle whose pixels are coloured by their place.
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.5, 1.0) * vec4f(0.25, 0.25, 1.0, 1.0);
}
@fragment fn fs(@builtin(position) p: vec4f) -> @location(0) vec4f {
    return vec4f(floor(p.xy) / 255.0, 0.2, 1.0);
}
