//! Scenes as codes, with the scenes that these stand for.

use ash::vk;
use gaurast::vk::{
    GaussianDecodingGAURAST as Decoding, GaussianDecodingTableGAURAST as Table,
    GaussianDecodingTablesGAURAST as Tables, GaussianHarmonicsCodesGAURAST as Codes,
    GaussianHarmonicsDecodingGAURAST as HarmonicsDecoding, GaussianHarmonicsLabelsGAURAST as Labels,
    GaussianRotationDecodingGAURAST as RotationDecoding, PipelineGaussianDecodingStateCreateInfoGAURAST as State,
};
use gaurast_oracle::oracle::decoding::{
    coefficient_of_color, coordinate_of_logarithm, quaternion_of_smaller, value_of_chunk,
};
use gaurast_testkit::{Addressed, Buffer, Gpu, Graphics};

use super::scenes::SceneBuffers;

/// The attribute of coefficient 0, by its number and its location.
const COLOR: usize = 4;

/// The binding of its codes. Other coefficients keep theirs.
const COLOR_BINDING: u32 = 7;

/// The bytes between tables, and before the first and after the last. They are part of none.
const GAP: usize = 64;

/// The numbers of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    Binary32,
    Binary64,
}

impl Numbers {
    fn format(self) -> vk::Format {
        match self {
            Self::Binary32 => vk::Format::R32_SFLOAT,
            Self::Binary64 => vk::Format::R64_SFLOAT,
        }
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Binary32 => 4,
            Self::Binary64 => 8,
        }
    }

    /// The number that memory has in the place of another one.
    fn stored(self, number: f64) -> f64 {
        match self {
            Self::Binary32 => f64::from(number as f32),
            Self::Binary64 => number,
        }
    }

    fn write(self, number: f64) -> Vec<u8> {
        match self {
            Self::Binary32 => (number as f32).to_le_bytes().to_vec(),
            Self::Binary64 => number.to_le_bytes().to_vec(),
        }
    }
}

/// The codes of three components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// A word of 11, 10 and 11 bits.
    Word,
    /// Three bytes.
    Bytes,
    /// Three integers of 16 bits, and one that is not used.
    Halves,
}

impl Layout {
    fn format(self) -> vk::Format {
        match self {
            Self::Word => vk::Format::R32_UINT,
            Self::Bytes => vk::Format::R8G8B8_UINT,
            Self::Halves => vk::Format::R16G16B16A16_UINT,
        }
    }

    fn bits(self) -> [i32; 3] {
        match self {
            Self::Word => [11, 10, 11],
            Self::Bytes => [8; 3],
            Self::Halves => [16; 3],
        }
    }

    fn write(self, [x, y, z]: [u32; 3]) -> Vec<u8> {
        match self {
            Self::Word => (x << 21 | y << 11 | z).to_le_bytes().to_vec(),
            Self::Bytes => [x, y, z].map(|code| code as u8).to_vec(),
            Self::Halves => [x, y, z, 0xabcd].iter().flat_map(|&code| (code as u16).to_le_bytes()).collect(),
        }
    }
}

/// The layout of the codes of spherical harmonics, in bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct CodeStrides {
    pub(super) gaussian: usize,
    pub(super) coefficient: usize,
    pub(super) component: usize,
}

impl CodeStrides {
    /// The codes of a component follow one another, as in compressed PLY.
    pub(super) fn by_component(coefficients: usize) -> Self {
        Self { gaussian: 3 * coefficients, coefficient: 1, component: coefficients }
    }

    /// The codes of a coefficient follow one another, with `padding` bytes after them.
    pub(super) fn by_coefficient(coefficients: usize, padding: usize) -> Self {
        Self { gaussian: (3 + padding) * coefficients, coefficient: 3 + padding, component: 1 }
    }
}

/// An attribute's codes in a vertex buffer.
#[derive(Clone, Debug)]
struct Attribute {
    format: vk::Format,
    stride: usize,
    contents: Vec<u8>,
}

/// Places of tables in the buffer that has all of them: structures whose addresses count from its beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Places {
    pub(super) position: Table,
    pub(super) scale: Table,
    pub(super) opacity: Table,
    pub(super) color: Table,
    pub(super) harmonics: Table,
    pub(super) codes: Codes,
    pub(super) labels: Labels,
}

/// A scene as codes.
#[derive(Clone, Debug)]
pub(super) struct Coded {
    /// The scene that the codes stand for.
    pub(super) scene: SceneBuffers,
    /// The decodings.
    pub(super) state: State<'static>,
    /// The places of the tables.
    pub(super) places: Places,
    /// The contents of the buffer of tables.
    pub(super) tables: Vec<u8>,
    /// The codes of positions, scales, rotations, opacities and coefficient 0, of those that are decoded.
    attributes: [Option<Attribute>; 5],
}

/// The binding of the codes of an attribute.
fn binding(number: usize) -> u32 {
    if number == COLOR { COLOR_BINDING } else { number as u32 }
}

impl Coded {
    /// A scene without codes.
    pub(super) fn new(scene: SceneBuffers) -> Self {
        Self {
            scene,
            state: State::default(),
            places: Places::default(),
            tables: vec![0x3e; GAP],
            attributes: [const { None }; 5],
        }
    }

    /// Adds bytes to the buffer of tables, and returns where they begin.
    fn add(&mut self, bytes: &[u8]) -> u64 {
        let start = self.tables.len().next_multiple_of(8);
        self.tables.resize(start, 0x3e);
        self.tables.extend_from_slice(bytes);
        self.tables.extend_from_slice(&[0x3e; GAP]);
        start as u64
    }

    /// Adds a table of numbers, in rows with `padding` bytes after each.
    fn table(&mut self, rows: &[Vec<f64>], numbers: Numbers, padding: usize, chunk_size: usize) -> Table {
        let mut bytes = Vec::new();
        for row in rows {
            bytes.extend(row.iter().flat_map(|&number| numbers.write(number)));
            bytes.extend(vec![0x3e; padding]);
        }
        let stride = rows.first().map_or(0, Vec::len) * numbers.bytes() + padding;
        Table::default()
            .size(bytes.len() as u64)
            .device_address(self.add(&bytes))
            .format(numbers.format())
            .stride(stride as u32)
            .chunk_size(chunk_size as u32)
    }

    /// Replaces values by codes between the bounds of chunks of `size`: the decoded values, the codes and the table.
    fn chunks<const N: usize>(
        &mut self,
        values: &[[f64; N]],
        bits: [i32; N],
        numbers: Numbers,
        size: usize,
    ) -> (Vec<[f64; N]>, Vec<[u32; N]>, Table) {
        let (mut decoded, mut codes, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for chunk in values.chunks(size) {
            let bound = |of: fn(f64, f64) -> f64, start: f64| -> [f64; N] {
                std::array::from_fn(|axis| numbers.stored(chunk.iter().map(|value| value[axis]).fold(start, of)))
            };
            let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
            for value in chunk {
                let code: [u32; N] = std::array::from_fn(|axis| {
                    let span = (high[axis] - low[axis]).max(1e-30);
                    let greatest = 2_f64.powi(bits[axis]) - 1.0;
                    ((value[axis] - low[axis]) / span * greatest).round().clamp(0.0, greatest) as u32
                });
                codes.push(code);
                decoded
                    .push(std::array::from_fn(|axis| value_of_chunk(code[axis], bits[axis], [low[axis], high[axis]])));
            }
            rows.push(low.iter().chain(&high).copied().collect());
        }
        let table = self.table(&rows, numbers, 3 * numbers.bytes(), size);
        (decoded, codes, table)
    }

    /// Replaces values by numbers in a codebook: the decoded values, the codes and the table.
    fn book<const N: usize>(&mut self, values: &[[f64; N]], numbers: Numbers) -> (Vec<[f64; N]>, Vec<[u32; N]>, Table) {
        let all = values.as_flattened().iter().copied();
        let (low, high) = (all.clone().fold(f64::INFINITY, f64::min), all.fold(f64::NEG_INFINITY, f64::max));
        // The values are not in order, and denser near the middle.
        let book: Vec<f64> = (0..256_u32)
            .map(|n| {
                let t = f64::from(n * 89 % 256) / 255.0 * 2.0 - 1.0;
                numbers.stored(f64::midpoint(low, high) + (high - low) / 2.0 * t * t.abs())
            })
            .collect();
        let nearest = |value: f64| {
            let distance = |n: &u32| (book[*n as usize] - value).abs();
            (0..256).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a codebook has values")
        };
        let codes: Vec<[u32; N]> = values.iter().map(|value| value.map(nearest)).collect();
        let decoded = codes.iter().map(|codes| codes.map(|code| book[code as usize])).collect();
        let table = self.table(&[book], numbers, 0, 0);
        (decoded, codes, table)
    }

    fn set(&mut self, attribute: usize, format: vk::Format, elements: impl Iterator<Item = Vec<u8>>) {
        let contents: Vec<Vec<u8>> = elements.collect();
        let stride = contents.first().map_or(4, Vec::len);
        self.attributes[attribute] = Some(Attribute { format, stride, contents: contents.concat() });
    }

    /// Positions between the bounds of chunks.
    #[must_use]
    pub(super) fn positions(mut self, layout: Layout, numbers: Numbers, size: usize, is_logarithm: bool) -> Self {
        let logarithm = |x: f64| if is_logarithm { x.abs().ln_1p().copysign(x) } else { x };
        let values: Vec<_> = self.scene.positions.iter().map(|p| p.map(|x| logarithm(f64::from(x)))).collect();
        let (decoded, codes, table) = self.chunks(&values, layout.bits(), numbers, size);
        let coordinate = |value: f64| if is_logarithm { coordinate_of_logarithm(value) } else { value as f32 };
        self.scene.positions = decoded.iter().map(|value| value.map(coordinate)).collect();
        self.set(0, layout.format(), codes.iter().map(|&codes| layout.write(codes)));
        self.places.position = table;
        self.state = self.state.position(Decoding::CHUNK).signed_log_position(is_logarithm);
        self
    }

    /// Scales between the bounds of chunks. `before` is applied to the scene's, and `after` to the decoded values.
    #[must_use]
    pub(super) fn scales(
        mut self,
        layout: Layout,
        numbers: Numbers,
        size: usize,
        before: fn(f64) -> f64,
        after: fn(f64) -> f32,
    ) -> Self {
        let values: Vec<_> = self.scene.scales.iter().map(|scale| scale.map(|s| before(s.into()))).collect();
        let (decoded, codes, table) = self.chunks(&values, layout.bits(), numbers, size);
        self.scene.scales = decoded.iter().map(|value| value.map(after)).collect();
        self.set(1, layout.format(), codes.iter().map(|&codes| layout.write(codes)));
        self.places.scale = table;
        self.state = self.state.scale(Decoding::CHUNK);
        self
    }

    /// Scales in a codebook.
    #[must_use]
    pub(super) fn scale_book(mut self, numbers: Numbers, before: fn(f64) -> f64, after: fn(f64) -> f32) -> Self {
        let values: Vec<_> = self.scene.scales.iter().map(|scale| scale.map(|s| before(s.into()))).collect();
        let (decoded, codes, table) = self.book(&values, numbers);
        self.scene.scales = decoded.iter().map(|value| value.map(after)).collect();
        self.set(1, vk::Format::R8G8B8_UINT, codes.iter().map(|&codes| Layout::Bytes.write(codes)));
        self.places.scale = table;
        self.state = self.state.scale(Decoding::CODEBOOK);
        self
    }

    /// Rotations of three components. Every seventh names no component that is left out, if they are bytes.
    #[must_use]
    pub(super) fn rotations(mut self, decoding: RotationDecoding) -> Self {
        let is_word = decoding == RotationDecoding::SMALLEST_THREE_10;
        let bits = if is_word { 10 } else { 8 };
        let mut elements = Vec::new();
        for (index, quaternion) in self.scene.rotations.iter_mut().enumerate() {
            let length = quaternion.iter().map(|c| c * c).sum::<f32>().sqrt().max(1e-30);
            let magnitude = |&component: &usize| quaternion[component].abs();
            let largest = (0..4).max_by(|a, b| magnitude(a).total_cmp(&magnitude(b))).expect("four components");
            let sign = f32::copysign(1.0, quaternion[largest]);
            let smaller = (0..4).filter(|&component| component != largest);
            let greatest = 2_f32.powi(bits) - 1.0;
            let codes: Vec<u32> = smaller
                .map(|component| {
                    let value = quaternion[component] * sign / length;
                    ((value * std::f32::consts::SQRT_2 + 1.0) / 2.0 * greatest).round().clamp(0.0, greatest) as u32
                })
                .collect();
            let codes = [codes[0], codes[1], codes[2]];
            let left_out = (is_word || index % 7 != 6).then_some(largest);
            let element = match left_out {
                _ if is_word => (largest as u32) << 30 | codes[0] << 20 | codes[1] << 10 | codes[2],
                left_out => {
                    let tag = left_out.map_or(251, |largest| 252 + largest as u32);
                    codes[0] | codes[1] << 8 | codes[2] << 16 | tag << 24
                }
            };
            elements.push(element.to_le_bytes().to_vec());
            *quaternion = quaternion_of_smaller(codes, bits, left_out);
        }
        let format = if is_word { vk::Format::R32_UINT } else { vk::Format::R8G8B8A8_UINT };
        self.set(2, format, elements.into_iter());
        self.state = self.state.rotation(decoding);
        self
    }

    /// Opacities in a codebook, or between the bounds of chunks of some size.
    #[must_use]
    pub(super) fn opacities(
        mut self,
        size: Option<usize>,
        numbers: Numbers,
        before: fn(f64) -> f64,
        after: fn(f64) -> f32,
    ) -> Self {
        let values: Vec<_> = self.scene.opacities.iter().map(|&opacity| [before(opacity.into())]).collect();
        let (decoded, codes, table) = match size {
            Some(size) => self.chunks(&values, [16], numbers, size),
            None => self.book(&values, numbers),
        };
        self.scene.opacities = decoded.iter().map(|&[value]| after(value)).collect();
        let (format, width) = if size.is_some() { (vk::Format::R16_UINT, 2) } else { (vk::Format::R8_UINT, 1) };
        self.set(3, format, codes.iter().map(|[code]| code.to_le_bytes()[..width].to_vec()));
        self.places.opacity = table;
        self.state = self.state.opacity(if size.is_some() { Decoding::CHUNK } else { Decoding::CODEBOOK });
        self
    }

    /// Coefficient 0 in words: a colour between the bounds of chunks of some size, or coefficients in a codebook.
    #[must_use]
    pub(super) fn colors(mut self, size: Option<usize>, numbers: Numbers) -> Self {
        let triples = (self.scene.degree + 1).pow(2) as usize;
        let is_color = size.is_some();
        let before = |k: f64| if is_color { k * 0.282_094_791_773_878_14 + 0.5 } else { k };
        let firsts = self.scene.sh.iter().step_by(triples);
        let values: Vec<_> = firsts.map(|k| k.map(|k| before(k.into()))).collect();
        let (decoded, codes, table) = match size {
            Some(size) => self.chunks(&values, [8; 3], numbers, size),
            None => self.book(&values, numbers),
        };
        let after = |value: f64| if is_color { coefficient_of_color(value) } else { value as f32 };
        for (first, value) in self.scene.sh.iter_mut().step_by(triples).zip(&decoded) {
            *first = value.map(after);
        }
        let word = |&[red, green, blue]: &[u32; 3]| (red << 24 | green << 16 | blue << 8 | 0x5a).to_le_bytes().to_vec();
        self.set(COLOR, vk::Format::R32_UINT, codes.iter().map(word));
        self.places.color = table;
        self.state = self.state.color(if is_color { Decoding::CHUNK } else { Decoding::CODEBOOK }).base_color(is_color);
        self
    }

    /// The other coefficients as bytes of each Gaussian.
    #[must_use]
    pub(super) fn harmonics(mut self, strides: CodeStrides, numbers: Numbers) -> Self {
        let rest = self.rest();
        let (decoded, codes, table) = self.book(&rest, numbers);
        self.set_rest(&decoded);
        self.places.harmonics = table;
        let each = (self.scene.degree + 1).pow(2) as usize - 1;
        let count = self.scene.positions.len();
        self.places.codes = self.codes(&codes, each, count, strides);
        self.state = self.state.spherical_harmonics(HarmonicsDecoding::CODEBOOK);
        self
    }

    /// The other coefficients as those of a palette's entries, of which there are `entries`. Some labels name none.
    #[must_use]
    pub(super) fn palette(mut self, strides: CodeStrides, numbers: Numbers, entries: usize) -> Self {
        let each = (self.scene.degree + 1).pow(2) as usize - 1;
        let count = self.scene.positions.len();
        let rest = self.rest();
        let (decoded, codes, table) = self.book(&rest[..each * entries], numbers);
        let label = |index: usize| (index * 37 + 11) % (entries + 3);
        let mut all = Vec::new();
        for index in 0..count {
            match decoded.get(label(index) * each..(label(index) + 1) * each) {
                Some(entry) => all.extend_from_slice(entry),
                None => all.extend(vec![[0.0; 3]; each]),
            }
        }
        self.set_rest(&all);
        self.places.harmonics = table;
        self.places.codes = self.codes(&codes, each, entries, strides);
        // Labels are four bytes apart.
        let labels: Vec<u8> =
            (0..count).flat_map(|index| [label(index) as u16, 0xabcd]).flat_map(u16::to_le_bytes).collect();
        self.places.labels = Labels::default().size(labels.len() as u64).device_address(self.add(&labels)).stride(4);
        self.state = self.state.spherical_harmonics(HarmonicsDecoding::PALETTE);
        self
    }

    /// Tells for each Gaussian if its opacity is one of the first `kept` values of the codebook.
    pub(super) fn numbers_of_opacities(&self, kept: usize) -> Vec<bool> {
        let codes = self.attributes[3].iter().flat_map(|attribute| &attribute.contents);
        codes.map(|&code| usize::from(code) < kept).collect()
    }

    /// The coefficients from 1 on, Gaussian by Gaussian.
    fn rest(&self) -> Vec<[f64; 3]> {
        let triples = (self.scene.degree + 1).pow(2) as usize;
        let rests = self.scene.sh.chunks(triples).flat_map(|all| &all[1..]);
        rests.map(|rgb| rgb.map(f64::from)).collect()
    }

    fn set_rest(&mut self, rest: &[[f64; 3]]) {
        let triples = (self.scene.degree + 1).pow(2) as usize;
        let places = self.scene.sh.chunks_mut(triples).flat_map(|all| &mut all[1..]);
        for (place, rgb) in places.zip(rest) {
            *place = rgb.map(|component| component as f32);
        }
    }

    /// Adds the codes of `count` Gaussians or entries with `each` coefficients.
    fn codes(&mut self, codes: &[[u32; 3]], each: usize, count: usize, strides: CodeStrides) -> Codes {
        let CodeStrides { gaussian, coefficient, component } = strides;
        let mut bytes = vec![0x77; gaussian * count];
        for (index, codes) in codes.chunks(each).enumerate() {
            for (k, rgb) in codes.iter().enumerate() {
                for (c, &code) in rgb.iter().enumerate() {
                    bytes[index * gaussian + k * coefficient + c * component] = code as u8;
                }
            }
        }
        Codes::default()
            .size(bytes.len() as u64)
            .device_address(self.add(&bytes))
            .stride(gaussian as u32)
            .coefficient_stride(coefficient as u32)
            .component_stride(component as u32)
    }

    /// Changes a pipeline's vertex input to that of the codes, and chains the decodings.
    pub(super) fn change(&self, graphics: &mut Graphics<'_>) {
        graphics.decoding = Some(self.state);
        for (number, attribute) in self.coded() {
            let binding = binding(number);
            graphics.bindings.retain(|other| other.binding != binding);
            graphics.bindings.push(vk::VertexInputBindingDescription {
                binding,
                stride: attribute.stride as u32,
                input_rate: vk::VertexInputRate::VERTEX,
            });
            let mut attributes = graphics.attributes.iter_mut();
            if let Some(own) = attributes.find(|own| own.location == number as u32) {
                (own.binding, own.format, own.offset) = (binding, attribute.format, 0);
            }
        }
        if self.state.spherical_harmonics != HarmonicsDecoding::NONE {
            let first = COLOR as u32;
            graphics.attributes.retain(|attribute| attribute.binding != first || attribute.location == first);
        }
    }

    /// The attributes that are decoded, by their numbers.
    fn coded(&self) -> impl Iterator<Item = (usize, &Attribute)> {
        let all = self.attributes.iter().enumerate();
        all.filter_map(|(number, attribute)| Some((number, attribute.as_ref()?)))
    }

    /// The vertex buffers of the codes, by their bindings.
    pub(super) fn buffers(&self, gpu: &Gpu) -> Vec<(u32, Buffer)> {
        let buffer = |(number, attribute): (usize, &Attribute)| (binding(number), Buffer::of(gpu, &attribute.contents));
        self.coded().map(buffer).collect()
    }

    /// The buffer of tables on a device, and the structure that has their addresses.
    pub(super) fn bound(&self, gpu: &Gpu) -> (Addressed, Tables<'static>) {
        let buffer = Addressed::of(gpu, &self.tables);
        let at = |table: Table| table.device_address(buffer.address + table.device_address);
        let places = self.places;
        let tables = Tables::default()
            .position(at(places.position))
            .scale(at(places.scale))
            .opacity(at(places.opacity))
            .color(at(places.color))
            .spherical_harmonics(at(places.harmonics))
            .codes(places.codes.device_address(buffer.address + places.codes.device_address))
            .labels(places.labels.device_address(buffer.address + places.labels.device_address));
        (buffer, tables)
    }
}
