//! USD text files with a `ParticleField3DGaussianSplat`.

use std::fmt::Write;

use crate::gaussian::Gaussian;

/// A scene as a layer has it.
#[derive(Clone, Debug)]
pub struct Usd {
    /// The Gaussians of the one prim.
    pub gaussians: Vec<Gaussian>,
    /// The attributes in binary16.
    pub is_half: bool,
    /// Attributes of the prim beside those of its Gaussians, a line each.
    pub attributes: Vec<String>,
    /// The transforms of the prim's parents, the outermost first: lines of attributes of each.
    pub parents: Vec<Vec<String>>,
    /// The axis that is upwards: `Y` or `Z`.
    pub up: char,
}

impl Usd {
    /// Gaussians without a transform, in binary32, with y upwards.
    pub fn new(gaussians: Vec<Gaussian>) -> Self {
        Self { gaussians, is_half: false, attributes: Vec::new(), parents: Vec::new(), up: 'Y' }
    }

    /// The same with a line of an attribute.
    #[must_use]
    pub fn with(mut self, line: &str) -> Self {
        self.attributes.push(line.to_owned());
        self
    }

    /// The same in binary16.
    #[must_use]
    pub fn half(self) -> Self {
        Self { is_half: true, ..self }
    }

    /// The same within a prim with these lines of attributes, outside of the others.
    #[must_use]
    pub fn within(mut self, lines: &[&str]) -> Self {
        self.parents.insert(0, lines.iter().map(ToString::to_string).collect());
        self
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut text = format!("#usda 1.0\n(\n    doc = \"CC0\"\n    upAxis = \"{}\"\n)\n\n", self.up);
        let mut indent = String::new();
        for (number, lines) in self.parents.iter().enumerate() {
            writeln!(text, "{indent}def Xform \"Parent{number}\"\n{indent}{{").expect("memory");
            indent += "    ";
            for line in lines {
                writeln!(text, "{indent}{line}").expect("memory");
            }
        }
        writeln!(text, "{indent}def ParticleField3DGaussianSplat \"Gaussians\"\n{indent}{{").expect("memory");
        let (suffix, vector, point, quaternion, number) = if self.is_half {
            ("h", "half3", "point3h", "quath", "half")
        } else {
            ("", "float3", "point3f", "quatf", "float")
        };
        let degree = self.gaussians.first().map_or(0, |one| one.harmonics.len().isqrt() - 1);
        let mut list = |kind: &str, name: &str, values: Vec<String>| {
            writeln!(text, "{indent}    {kind}[] {name}{suffix} = [{}]", values.join(", ")).expect("memory");
        };
        let each = |of: &dyn Fn(&Gaussian) -> Vec<f32>| {
            self.gaussians.iter().map(|one| self.tuple(&of(one))).collect::<Vec<_>>()
        };
        list(point, "positions", each(&|one| one.position.to_vec()));
        list(
            quaternion,
            "orientations",
            each(&|one| {
                let [x, y, z, w] = one.rotation;
                vec![w, x, y, z]
            }),
        );
        list(vector, "scales", each(&|one| one.scale.to_vec()));
        let opacities = self.gaussians.iter().map(|one| self.number(one.opacity).to_string());
        list(number, "opacities", opacities.collect());
        let harmonics = self.gaussians.iter().flat_map(|one| &one.harmonics).map(|triple| self.tuple(triple));
        list(vector, "radiance:sphericalHarmonicsCoefficients", harmonics.collect());
        writeln!(text, "{indent}    uniform int radiance:sphericalHarmonicsDegree = {degree}").expect("memory");
        for line in &self.attributes {
            writeln!(text, "{indent}    {line}").expect("memory");
        }
        writeln!(text, "{indent}}}").expect("memory");
        for _ in &self.parents {
            indent.truncate(indent.len() - 4);
            writeln!(text, "{indent}}}").expect("memory");
        }
        text.into_bytes()
    }

    /// A number as the file holds it.
    fn number(&self, value: f32) -> f32 {
        if self.is_half { half::f16::from_f32(value).to_f32() } else { value }
    }

    fn tuple(&self, values: &[f32]) -> String {
        let numbers: Vec<String> = values.iter().map(|value| self.number(*value).to_string()).collect();
        format!("({})", numbers.join(", "))
    }
}
