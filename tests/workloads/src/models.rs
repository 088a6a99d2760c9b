//! Triangle models from files: their triangles and textures, their lighting and their views.

use std::io::BufReader;
use std::path::{Path, PathBuf};

use ash::vk;
use glam::{Mat4, Vec2, Vec3, Vec4};
use image::RgbaImage;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use gaurast_testkit::drawn::Missing;
use gaurast_testkit::{
    Bindings, Buffer, Commands, Gpu, Image, ImageOptions, Pipeline, PipelineOptions, Resource, Sampler, Target,
    attribute, binding, depth_test,
};

/// A corner of a model's triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Corner {
    /// Position.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates, from the top left.
    pub uv: [f32; 2],
}

/// A part of a model, with one set of textures.
pub struct Part {
    /// Its corners.
    pub corners: Vec<Corner>,
    /// Indices of corners, three for each triangle.
    pub indices: Vec<u32>,
    /// The colour texture.
    pub diffuse: RgbaImage,
    /// Normals in the model's space, which replace those of the corners.
    pub normals: Option<RgbaImage>,
    /// The share of specular reflection, in the first channel.
    pub specular: Option<RgbaImage>,
}

/// A model.
pub struct Model {
    /// Its parts.
    pub parts: Vec<Part>,
}

fn missing(path: &Path) -> impl Fn(String) -> Missing {
    let path = path.display().to_string();
    move |error| Missing(format!("{path}: {error}"))
}

/// The path of a file of the test data.
fn in_data(name: &str) -> Result<PathBuf, Missing> {
    let folder = gaurast_runner::data_folder();
    let folder = folder.ok_or_else(|| Missing("GAURAST_TEST_DATA, which names their folder".into()));
    Ok(folder?.join(name))
}

fn grey() -> RgbaImage {
    RgbaImage::from_pixel(1, 1, image::Rgba([190, 180, 170, 255]))
}

impl Model {
    /// The path of the head's file in the test data.
    pub const AFRICAN_HEAD: &str = "meshes/african_head/african_head.obj";
    /// The path of the duck's file.
    pub const DUCK: &str = "meshes/Duck.glb";
    /// The path of the bunny's file.
    pub const BUNNY: &str = "meshes/bunny.ply";

    /// The head with its eyes: three OBJ files with TGA textures.
    ///
    /// # Errors
    /// [`Missing`] if a file is missing.
    pub fn african_head() -> Result<Self, Missing> {
        let head = in_data(Self::AFRICAN_HEAD)?;
        let texture = |name: String| {
            let path = head.with_file_name(name);
            let image = image::open(&path);
            let image = image.map_err(|error| missing(&path)(error.to_string()));
            Ok::<_, Missing>(image?.into_rgba8())
        };
        let names = ["african_head", "african_head_eye_inner"];
        let parts = names.map(|name| {
            let (corners, indices) = read_obj(&head.with_file_name(format!("{name}.obj")))?;
            Ok(Part {
                corners,
                indices,
                diffuse: texture(format!("{name}_diffuse.tga"))?,
                normals: Some(texture(format!("{name}_nm.tga"))?),
                specular: Some(texture(format!("{name}_spec.tga"))?),
            })
        });
        let parts: Result<_, _> = parts.into_iter().collect();
        Ok(Self { parts: parts? })
    }

    /// The duck: a binary glTF file with its texture.
    ///
    /// # Errors
    /// [`Missing`] if the file is missing.
    pub fn duck() -> Result<Self, Missing> {
        let path = in_data(Self::DUCK)?;
        let missing = missing(&path);
        let gltf = gltf::Gltf::open(&path).map_err(|error| missing(error.to_string()))?;
        let blob = gltf.blob.as_deref().unwrap_or_default();
        let mut parts = Vec::new();
        for primitive in gltf.meshes().flat_map(|mesh| mesh.primitives()) {
            let reader = primitive.reader(|_| Some(blob));
            let triples = |values: Option<Vec<[f32; 3]>>| values.unwrap_or_default();
            let positions = triples(reader.read_positions().map(Iterator::collect));
            let normals = triples(reader.read_normals().map(Iterator::collect));
            let uvs = reader.read_tex_coords(0).map(|uvs| uvs.into_f32());
            let uvs: Vec<[f32; 2]> = uvs.map(Iterator::collect).unwrap_or_default();
            let corners = (0..positions.len()).map(|index| Corner {
                position: positions[index],
                normal: normals[index],
                uv: uvs[index],
            });
            let indices = reader.read_indices().map(|indices| indices.into_u32());
            let material = primitive.material().pbr_metallic_roughness();
            let texture = material.base_color_texture();
            let source = texture.map(|texture| texture.texture().source().source());
            let diffuse = match source {
                Some(gltf::image::Source::View { view, .. }) => {
                    let bytes = &blob[view.offset()..view.offset() + view.length()];
                    let image = image::load_from_memory(bytes);
                    image.map_err(|error| missing(error.to_string()))?.into_rgba8()
                }
                _ => grey(),
            };
            parts.push(Part {
                corners: corners.collect(),
                indices: indices.map(Iterator::collect).unwrap_or_default(),
                diffuse,
                normals: None,
                specular: None,
            });
        }
        Ok(Self { parts })
    }

    /// The bunny: a text PLY file without normals or colours.
    ///
    /// # Errors
    /// [`Missing`] if the file is missing.
    pub fn bunny() -> Result<Self, Missing> {
        let path = in_data(Self::BUNNY)?;
        let missing = missing(&path);
        let file = std::fs::File::open(&path).map_err(|error| missing(error.to_string()))?;
        let ply = Parser::<DefaultElement>::new().read_ply(&mut BufReader::new(file));
        let ply = ply.map_err(|error| missing(error.to_string()))?;
        let float = |element: &DefaultElement, name: &str| match element.get(name) {
            Some(Property::Float(value)) => *value,
            _ => 0.0,
        };
        let mut corners: Vec<Corner> = ply.payload["vertex"]
            .iter()
            .map(|vertex| Corner { position: ["x", "y", "z"].map(|name| float(vertex, name)), ..Corner::default() })
            .collect();
        let mut indices = Vec::new();
        for face in &ply.payload["face"] {
            if let Some(Property::ListInt(face)) = face.get("vertex_indices") {
                indices.extend(face.iter().map(|index| index.cast_unsigned()));
            }
        }
        smooth_normals(&mut corners, &indices);
        let part = Part { corners, indices, diffuse: grey(), normals: None, specular: None };
        Ok(Self { parts: vec![part] })
    }

    /// The centre of the bounding box, and half of its diagonal.
    fn bounds(&self) -> (Vec3, f32) {
        let corners = self.parts.iter().flat_map(|part| &part.corners);
        let positions = corners.map(|corner| Vec3::from(corner.position));
        let (low, high) = positions.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), position| {
            (low.min(position), high.max(position))
        });
        (0.5 * (low + high), 0.5 * (high - low).length())
    }
}

fn read_obj(path: &Path) -> Result<(Vec<Corner>, Vec<u32>), Missing> {
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..tobj::LoadOptions::default() };
    let models = tobj::load_obj(path, &options);
    let (models, _) = models.map_err(|error| missing(path)(error.to_string()))?;
    let (mut corners, mut indices) = (Vec::new(), Vec::new());
    for tobj::Model { mesh, .. } in models {
        let first = corners.len() as u32;
        let triple = |values: &[f32], index: usize| [0, 1, 2].map(|axis| values[3 * index + axis]);
        corners.extend((0..mesh.positions.len() / 3).map(|index| Corner {
            position: triple(&mesh.positions, index),
            normal: triple(&mesh.normals, index),
            // OBJ counts texture coordinates from the bottom.
            uv: [mesh.texcoords[2 * index], 1.0 - mesh.texcoords[2 * index + 1]],
        }));
        indices.extend(mesh.indices.iter().map(|index| first + index));
    }
    Ok((corners, indices))
}

/// Each corner's mean normal of its triangles, weighted by their areas.
fn smooth_normals(corners: &mut [Corner], indices: &[u32]) {
    for triangle in indices.chunks_exact(3) {
        let triangle = [0, 1, 2].map(|index| triangle[index] as usize);
        let [a, b, c] = triangle.map(|index| Vec3::from(corners[index].position));
        let normal = (b - a).cross(c - a);
        for index in triangle {
            corners[index].normal = (Vec3::from(corners[index].normal) + normal).into();
        }
    }
    for corner in corners {
        corner.normal = Vec3::from(corner.normal).normalize_or(Vec3::Y).into();
    }
}

/// An image and its mipmap levels, each with a quarter of the texels of the one before, by averaging.
fn levels(image: &RgbaImage) -> Vec<Vec<[u8; 4]>> {
    let mut image = image.clone();
    let texels = |image: &RgbaImage| image.pixels().map(|pixel| pixel.0).collect();
    let mut levels = vec![texels(&image)];
    while image.width() > 1 || image.height() > 1 {
        let (width, height) = ((image.width() / 2).max(1), (image.height() / 2).max(1));
        let at = |x: u32, y: u32| {
            let (x, y) = (x.min(image.width() - 1), y.min(image.height() - 1));
            image.get_pixel(x, y).0.map(u32::from)
        };
        image = RgbaImage::from_fn(width, height, |x, y| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| at(2 * x + dx, 2 * y + dy));
            let sum = |channel: usize| four.iter().map(|texel| texel[channel]).sum::<u32>();
            image::Rgba([0, 1, 2, 3].map(|channel| (sum(channel) / 4) as u8))
        });
        levels.push(texels(&image));
    }
    levels
}

/// The uniforms of both stages.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Uniforms {
    to_clip: Mat4,
    eye: Vec4,
    light: Vec4,
}

const VERTEX: &str = "
    layout(set = 0, binding = 0) uniform Uniforms { mat4 to_clip; vec4 eye; vec4 light; };
    layout(location = 0) in vec3 position;
    layout(location = 1) in vec3 normal;
    layout(location = 2) in vec2 uv;
    layout(location = 0) out vec3 v_position;
    layout(location = 1) out vec3 v_normal;
    layout(location = 2) out vec2 v_uv;
    void main() {
        gl_Position = to_clip * vec4(position, 1.0);
        v_position = position;
        v_normal = normal;
        v_uv = uv;
    }";

const FRAGMENT: &str = "
    layout(constant_id = 0) const bool MAPS = false;
    layout(set = 0, binding = 0) uniform Uniforms { mat4 to_clip; vec4 eye; vec4 light; };
    layout(set = 0, binding = 1) uniform sampler2D diffuse;
    layout(set = 0, binding = 2) uniform sampler2D normals;
    layout(set = 0, binding = 3) uniform sampler2D specular;
    layout(location = 0) in vec3 v_position;
    layout(location = 1) in vec3 v_normal;
    layout(location = 2) in vec2 v_uv;
    layout(location = 0) out vec4 color;
    void main() {
        vec3 normal = MAPS ? texture(normals, v_uv).xyz * 2.0 - 1.0 : v_normal;
        normal = normalize(normal);
        vec3 to_eye = normalize(eye.xyz - v_position);
        float shine = MAPS ? texture(specular, v_uv).r : 0.2;
        vec3 middle = normalize(light.xyz + to_eye);
        float mirrored = shine * pow(max(dot(normal, middle), 0.0), 20.0);
        float lit = 0.15 + 0.85 * max(dot(normal, light.xyz), 0.0);
        color = vec4(texture(diffuse, v_uv).rgb * lit + mirrored, 1.0);
    }";

/// A part on a device.
struct ReadyPart {
    pipeline: Pipeline,
    bindings: Bindings,
    corners: Buffer,
    indices: Buffer,
    count: u32,
    _images: Vec<Image>,
}

/// A model that is ready to be drawn.
pub struct Ready {
    parts: Vec<ReadyPart>,
    _uniforms: Buffer,
    _sampler: Sampler,
}

impl Ready {
    /// Prepares the model for drawing to `target`, seen from `direction`.
    pub fn new(gpu: &Gpu, target: &Target, model: &Model, direction: Vec3) -> Self {
        let uniforms = Buffer::of(gpu, &[uniforms(model, target.options.size, direction)]);
        let sampler = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .max_lod(vk::LOD_CLAMP_NONE);
        let sampler = Sampler::new(gpu, &sampler);
        let parts = model.parts.iter();
        Self {
            parts: parts.map(|part| ReadyPart::new(gpu, target, part, &uniforms, &sampler)).collect(),
            _uniforms: uniforms,
            _sampler: sampler,
        }
    }

    /// Draws it.
    pub fn draw(&self, commands: &Commands) {
        for part in &self.parts {
            commands.bind(&part.pipeline);
            commands.bind_set(&part.bindings, &[]);
            commands.vertices(&part.corners);
            commands.indices(&part.indices, 0, vk::IndexType::UINT32);
            commands.draw_indexed(0..part.count, 0);
        }
    }
}

fn uniforms(model: &Model, [width, height]: [u32; 2], direction: Vec3) -> Uniforms {
    let (middle, radius) = model.bounds();
    let eye = middle + 2.6 * radius * direction.normalize();
    let aspect = width as f32 / height as f32;
    let to_clip = perspective(aspect, 0.5 * radius, 6.0 * radius) * look_at(eye, middle);
    Uniforms { to_clip, eye: eye.extend(1.0), light: Vec3::new(0.4, 0.6, 0.7).normalize().extend(0.0) }
}

/// The matrix from world space to a camera at `eye` that looks at `middle`: x to the right, y down, z forward.
fn look_at(eye: Vec3, middle: Vec3) -> Mat4 {
    let forward = (middle - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let down = forward.cross(right);
    let row = |axis: Vec3| axis.extend(-axis.dot(eye));
    Mat4::from_cols(row(right), row(down), row(forward), Vec4::W).transpose()
}

/// The matrix from that camera to clip coordinates.
fn perspective(aspect: f32, near: f32, far: f32) -> Mat4 {
    let focal = 2.4;
    let depth = far / (far - near);
    Mat4::from_cols(
        Vec4::X * (focal / aspect),
        Vec4::Y * focal,
        Vec4::new(0.0, 0.0, depth, 1.0),
        Vec4::new(0.0, 0.0, -near * depth, 0.0),
    )
}

impl ReadyPart {
    fn new(gpu: &Gpu, target: &Target, part: &Part, uniforms: &Buffer, sampler: &Sampler) -> Self {
        let texture = |image: &RgbaImage| {
            let size = Vec2::new(image.width() as f32, image.height() as f32).as_uvec2();
            let format = vk::Format::R8G8B8A8_UNORM;
            let usage = vk::ImageUsageFlags::empty();
            let options = ImageOptions::new(format, size.into(), usage);
            Image::textured(gpu, &options, &levels(image))
        };
        let maps = part.normals.as_ref().zip(part.specular.as_ref());
        let mut images = vec![texture(&part.diffuse)];
        images.extend(maps.iter().map(|(normals, _)| texture(normals)));
        images.extend(maps.iter().map(|(_, specular)| texture(specular)));
        let at = |index: usize| images[index.min(images.len() - 1)].view;
        let mut resources = vec![Resource::Uniform(uniforms.raw)];
        resources.extend([0, 1, 2].map(|index| Resource::Texture(at(index), sampler.raw)));
        let bindings = Bindings::new(gpu, &resources);
        let options = PipelineOptions {
            vertex: VERTEX,
            fragment: Some(FRAGMENT),
            specialization: vec![(0, u32::from(maps.is_some()))],
            vertex_bindings: vec![binding(0, size_of::<Corner>() as u32)],
            vertex_attributes: vec![
                attribute(0, vk::Format::R32G32B32_SFLOAT, 0),
                attribute(1, vk::Format::R32G32B32_SFLOAT, 12),
                attribute(2, vk::Format::R32G32_SFLOAT, 24),
            ],
            depth_stencil: depth_test(vk::CompareOp::LESS),
            bindings: Some(&bindings),
            ..PipelineOptions::default()
        };
        Self {
            pipeline: Pipeline::new(gpu, target, &options),
            corners: Buffer::of(gpu, &part.corners),
            indices: Buffer::of(gpu, &part.indices),
            count: part.indices.len() as u32,
            bindings,
            _images: images,
        }
    }
}
