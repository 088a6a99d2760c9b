//! Cases of `KHR_gaussian_splatting`, from the text of glTF's repository at [`TEXT`].

use gaurast_oracle::oracle::OracleState;
use serde_json::json;

use crate::case::{Case, Freedom, Level, Source, aslant};
use crate::gaussian::Gaussian;
use crate::gltf_file::{Component, Gltf};

/// The commit of <https://github.com/KhronosGroup/glTF> with the text (Release Candidate).
pub const TEXT: &str = "63770cc70a3709cf101a42cece0bdf602b37e2e7";

const RED: [f64; 3] = [0.9, 0.2, 0.1];
const GREEN: [f64; 3] = [0.1, 0.8, 0.3];
const BLUE: [f64; 3] = [0.2, 0.3, 0.9];

use Level::{Choice, Normative, Recommended};

/// An ellipsoid of three unlike axes that is turned about an unlike axis.
fn turned() -> Gaussian {
    Gaussian::new(RED).scaled(0.7, 0.3, 0.45).turned([1.0, 2.0, 3.0], 50.0)
}

fn file(gaussians: impl IntoIterator<Item = Gaussian>) -> Gltf {
    Gltf::new(gaussians.into_iter().collect())
}

fn one(gaussian: Gaussian) -> Source {
    Source::Gltf(file([gaussian]))
}

fn case(name: &str, level: Level, clause: &'static str, shows: &'static str, gltf: Gltf) -> Case {
    Case::of_format(name, level, clause, shows, Source::Gltf(gltf))
}

fn without_cut_off(state: OracleState) -> OracleState {
    Freedom::CutOff.taken(state)
}

/// The cases.
pub fn all() -> Vec<Case> {
    let mut cases = attributes();
    cases.extend(components());
    cases.extend(harmonics());
    cases.extend(nodes());
    cases.extend(composition());
    cases.extend(open());
    cases
}

/// The meaning of attributes.
fn attributes() -> Vec<Case> {
    let shown = [Gaussian::new(RED).at(-0.9, 0.5, 0.0), Gaussian::new(GREEN).at(0.6, -0.4, -0.5)];
    let upside_down = [Gaussian::new(RED).at(-0.9, -0.5, 0.0), Gaussian::new(GREEN).at(0.6, 0.4, -0.5)];
    let [x, y, z, w] = turned().rotation;
    let conjugate = [-x, -y, -z, w];
    let sigmoid = |opacity: f32| (1.0 / (1.0 + libm::exp(-f64::from(opacity)))) as f32;
    let third = Gaussian::new(BLUE).opaque(0.35);
    vec![
        case(
            "position",
            Normative,
            "Attributes: POSITION",
            "Centres, with y upwards and z towards the viewer.",
            file(shown),
        )
        .unlike("y downwards", Source::Gltf(file(upside_down))),
        case(
            "scale",
            Normative,
            "Attributes: SCALE",
            "Scales are linear.",
            file([Gaussian::new(RED).scaled(0.7, 0.25, 0.4)]),
        )
        .unlike("the scales are logarithms", one(Gaussian::new(RED).scaled(2.01, 1.28, 1.49))),
        case("rotation", Normative, "Attributes: ROTATION", "Quaternions are x, y, z, w.", file([turned()]))
            .unlike("quaternions are w, x, y, z", one(turned().with_rotation([y, z, w, x]))),
        case(
            "rotation-sense",
            Normative,
            "Splat Reconstruction: C",
            "The rotation takes local axes to the mesh's.",
            file([turned().at(0.3, 0.2, 0.0)]),
        )
        .unlike("the inverse rotation", one(turned().at(0.3, 0.2, 0.0).with_rotation(conjugate))),
        case("opacity", Normative, "Attributes: OPACITY", "Opacities are linear.", file([third.clone()]))
            .unlike("the opacity is a logit", one(third.opaque(sigmoid(0.35)))),
        case(
            "covariance",
            Normative,
            "Splat Reconstruction: Sigma",
            "A covariance of three unlike axes, seen aslant.",
            file([turned()]),
        )
        .seen_by(aslant())
        .unlike("the last two axes exchanged", one(turned().scaled(0.7, 0.45, 0.3))),
        case(
            "projection",
            Normative,
            "Splat Projection: J",
            "Far from the axis J's last column counts.",
            file([Gaussian::new(GREEN).scaled(0.2, 0.2, 0.9).at(1.2, 0.7, 1.0)]),
        )
        .unlike("a sphere of the first scale", one(Gaussian::new(GREEN).scaled(0.2, 0.2, 0.2).at(1.2, 0.7, 1.0))),
        case(
            "view",
            Normative,
            "Splat Projection: W",
            "A camera that is rolled.",
            file([turned(), Gaussian::new(BLUE).at(0.8, 0.6, 0.4).scaled(0.5, 0.2, 0.2)]),
        )
        .seen_by(aslant()),
        case(
            "material",
            Normative,
            "Dependencies on glTF",
            "The primitive's material is ignored.",
            Gltf { material: Some([0.0, 1.0, 0.0, 1.0]), ..file([Gaussian::new(RED)]) },
        )
        .unlike("the material's colour", one(Gaussian::new([0.0, 1.0, 0.0]))),
        case(
            "fallback",
            Normative,
            "Fallback Behavior",
            "COLOR_0 is for renderers without the extension.",
            Gltf { fallback: Some([0.0, 1.0, 0.0, 1.0]), ..file([Gaussian::new(RED)]) },
        )
        .unlike("the colour of COLOR_0", one(Gaussian::new([0.0, 1.0, 0.0]))),
    ]
}

/// The component types of the table of attributes, and accessors.
fn components() -> Vec<Case> {
    let clause = "Attributes: component types";
    let accessors = "Attributes; glTF 2.0, 3.6.2";
    let both = || file([turned().at(-0.5, 0.25, 0.0), Gaussian::new(BLUE).at(0.75, -0.25, -0.5)]);
    let flat = |scale: [f32; 3]| {
        let [x, y, z] = scale;
        Gaussian::new(RED).scaled(x, y, z)
    };
    vec![
        case(
            "rotation-byte",
            Normative,
            clause,
            "Rotations in signed bytes, normalized.",
            Gltf {
                rotation: Component::Byte,
                ..file([flat([0.7, 0.3, 0.4]).with_rotation([0.0, 0.0, 76.0 / 127.0, 102.0 / 127.0])])
            },
        ),
        case(
            "rotation-short",
            Normative,
            clause,
            "Rotations in signed 16-bit integers, normalized.",
            Gltf { rotation: Component::Short, ..file([turned()]) },
        ),
        case(
            "scale-unsigned-byte",
            Normative,
            clause,
            "Scales in bytes, not normalized, in a node of scale 0.1.",
            Gltf {
                scale: Component::UnsignedByte,
                ..file([flat([7.0, 3.0, 4.0])]).in_node(json!({"scale": [0.1, 0.1, 0.1]}))
            },
        )
        .unlike("normalized scales", one(flat([0.003, 0.001, 0.002]))),
        case(
            "scale-unsigned-byte-normalized",
            Normative,
            clause,
            "Scales in bytes, normalized.",
            Gltf {
                scale: Component::UnsignedByteNormalized,
                ..file([flat([178.0 / 255.0, 77.0 / 255.0, 102.0 / 255.0])])
            },
        ),
        case(
            "scale-unsigned-short",
            Normative,
            clause,
            "Scales in 16-bit integers, not normalized.",
            Gltf {
                scale: Component::UnsignedShort,
                ..file([flat([700.0, 300.0, 400.0])]).in_node(json!({"scale": [0.001, 0.001, 0.001]}))
            },
        )
        .unlike("normalized scales", one(flat([0.00001, 0.00001, 0.00001]))),
        case(
            "scale-unsigned-short-normalized",
            Normative,
            clause,
            "Scales in 16-bit integers, normalized.",
            Gltf { scale: Component::UnsignedShortNormalized, ..file([flat([0.7, 0.3, 0.4])]) },
        ),
        case(
            "opacity-unsigned-byte",
            Normative,
            clause,
            "Opacities in bytes, normalized.",
            Gltf { opacity: Component::UnsignedByteNormalized, ..file([Gaussian::new(BLUE).opaque(102.0 / 255.0)]) },
        ),
        case(
            "opacity-unsigned-short",
            Normative,
            clause,
            "Opacities in 16-bit integers, normalized.",
            Gltf { opacity: Component::UnsignedShortNormalized, ..file([Gaussian::new(BLUE).opaque(0.6)]) },
        ),
        case(
            "position-short",
            Normative,
            "Attributes: POSITION; KHR_mesh_quantization",
            "Quantized positions.",
            Gltf {
                position: Component::Short,
                ..file([Gaussian::new(RED).at(-0.5, 0.25, 0.0), Gaussian::new(GREEN).at(0.75, -0.25, -0.5)])
            },
        ),
        case(
            "interleaved",
            Normative,
            accessors,
            "Attributes that share a buffer view.",
            Gltf { is_interleaved: true, ..both() },
        ),
        case("sparse", Normative, accessors, "Positions in a sparse accessor.", Gltf { is_sparse: true, ..both() })
            .unlike(
                "the zeros that are replaced",
                Source::Gltf(file(both().gaussians.into_iter().map(|one| one.at(0.0, 0.0, 0.0)))),
            ),
    ]
}

/// Spherical harmonics. A renderer may ignore those above degree 0.
fn harmonics() -> Vec<Case> {
    let clause = "Calculating color from Spherical Harmonics";
    let round = || Gaussian::new([0.5, 0.4, 0.6]).scaled(0.6, 0.6, 0.6);
    let two = |degree: u32, strength: f32| {
        let right = round().at(0.9, -0.4, -1.5).with_harmonics(degree, -strength);
        [round().at(-0.6, 0.3, 0.0).with_harmonics(degree, strength), right]
    };
    let only = |at: usize| {
        let mut one = round();
        one.harmonics.resize(16, [0.0; 3]);
        one.harmonics[at] = [0.6, -0.5, 0.4];
        one
    };
    let mut cases = vec![
        case(
            "harmonics-0",
            Normative,
            clause,
            "The constant of degree 0, and 0.5.",
            file([Gaussian { harmonics: vec![[1.2, -0.8, 0.3]], ..round() }]),
        )
        .unlike("the coefficients are the colour", one(Gaussian::new([1.2, -0.8, 0.3]).scaled(0.6, 0.6, 0.6))),
    ];
    for (degree, name) in [(1, "harmonics-1"), (2, "harmonics-2"), (3, "harmonics-3")] {
        let gaussians = two(degree, 0.7);
        let plain = gaussians.clone().map(|one| Gaussian { harmonics: vec![one.harmonics[0]], ..one });
        cases.push(
            case(name, Recommended, clause, "All functions up to a degree, seen aslant.", file(gaussians))
                .seen_by(aslant())
                .unlike("degree 0 alone", Source::Gltf(file(plain))),
        );
    }
    let order = "Spherical Harmonics Attributes: order";
    let shows = "One function alone: its place, sign and constant.";
    for (at, name, other) in [
        (1, "harmonics-1-m-1", 3),
        (2, "harmonics-1-m0", 3),
        (3, "harmonics-1-m1", 1),
        (4, "harmonics-2-m-2", 8),
        (6, "harmonics-2-m0", 5),
        (7, "harmonics-2-m1", 5),
        (12, "harmonics-3-m0", 13),
        (15, "harmonics-3-m3", 9),
    ] {
        cases.push(
            case(name, Recommended, order, shows, file([only(at)]))
                .seen_by(aslant())
                .unlike("another function of the degree", one(only(other))),
        );
    }
    cases
}

/// Transforms of nodes.
fn nodes() -> Vec<Case> {
    let clause = "Splat Reconstruction: M";
    let mesh = || turned().at(0.2, 0.1, 0.1);
    let stretched = json!({"scale": [1.6, 0.6, 1.0]});
    let turn = [0.0, 0.0, 0.382_683_43, 0.923_879_5];
    let lit = || Gaussian::new([0.5; 3]).scaled(0.5, 0.5, 0.5).with_harmonics(1, 1.0);
    let quarter = [0.0, 0.707_106_77, 0.0, 0.707_106_77];
    vec![
        case(
            "node-translation",
            Normative,
            clause,
            "A node that moves.",
            file([mesh()]).in_node(json!({"translation": [0.6, -0.4, 0.5]})),
        )
        .unlike("no transform", one(mesh())),
        case(
            "node-rotation",
            Normative,
            clause,
            "A node that turns.",
            file([mesh()]).in_node(json!({"rotation": turn})),
        )
        .unlike("no transform", one(mesh())),
        case(
            "node-scale",
            Normative,
            clause,
            "A node that scales alike along its axes.",
            file([mesh()]).in_node(json!({"scale": [1.5, 1.5, 1.5]})),
        )
        .unlike("no transform", one(mesh())),
        case(
            "node-stretch",
            Normative,
            clause,
            "A node that scales unlike along its axes.",
            file([mesh()]).in_node(stretched.clone()),
        )
        .unlike(
            "the node stretches the Gaussian's own axes",
            one({
                let [x, y, z] = mesh().scale;
                mesh().scaled(1.6 * x, 0.6 * y, z).at(0.32, 0.06, 0.1)
            }),
        ),
        case(
            "node-matrix",
            Normative,
            clause,
            "A matrix that turns, scales and moves.",
            file([mesh()]).in_node(json!({
                "matrix": [0.0, 1.25, 0.0, 0.0, -0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.4, 0.3, 0.0, 1.0],
            })),
        )
        .unlike("no transform", one(mesh())),
        case(
            "node-parents",
            Normative,
            clause,
            "A node within two others.",
            Gltf {
                nodes: vec![
                    json!({"children": [1], "translation": [0.5, 0.0, 0.0], "rotation": turn}),
                    json!({"children": [2], "scale": [1.5, 1.0, 1.0]}),
                    json!({"mesh": 0, "translation": [0.0, -0.4, 0.0], "rotation": turn}),
                ],
                ..file([mesh()])
            },
        )
        .unlike(
            "the innermost node alone",
            Source::Gltf(file([mesh()]).in_node(json!({
                "translation": [0.0, -0.4, 0.0],
                "rotation": turn,
            }))),
        ),
        case(
            "node-copies",
            Normative,
            clause,
            "Two nodes with one mesh, whose Gaussians are sorted together.",
            Gltf {
                nodes: vec![
                    json!({"mesh": 0, "translation": [-0.4, 0.0, 0.3]}),
                    json!({"mesh": 0, "translation": [0.4, 0.0, -0.3]}),
                ],
                roots: vec![0, 1],
                ..file([Gaussian::new(RED).at(0.0, 0.2, 0.0), Gaussian::new(BLUE).at(0.0, -0.2, -0.5)])
            },
        ),
        case(
            "node-harmonics",
            Recommended,
            "Splat Lighting",
            "Harmonics turn with the node.",
            file([lit()]).in_node(json!({"rotation": quarter})),
        )
        .seen_by(aslant())
        .unlike("harmonics that stay", one(lit())),
    ]
}

/// Sorting and blending.
fn composition() -> Vec<Case> {
    // By distance the left one is in front; by depth, the right one.
    let sorted =
        || [Gaussian::new(RED).at(0.2, 0.0, 0.0), Gaussian::new(GREEN).at(1.3, 0.0, 0.15).scaled(0.5, 0.5, 0.5)];
    let stack = |colors: &[[f64; 3]]| -> Vec<Gaussian> {
        let placed = |(index, color): (usize, &[f64; 3])| {
            let at = index as f32;
            Gaussian::new(*color).at(0.25 * at - 0.4, 0.1 - 0.15 * at, -0.4 * at).opaque(0.6)
        };
        colors.iter().enumerate().map(placed).collect()
    };
    let layers: Vec<Gaussian> = (0..12)
        .map(|index| {
            let at = index as f32;
            let color = [0.1 + 0.07 * f64::from(index), 0.9 - 0.06 * f64::from(index), 0.3];
            let x = 0.1 * at - 0.5;
            Gaussian::new(color).at(x, 0.07 * (at % 5.0) - 0.15, -0.15 * at).opaque(0.3)
        })
        .collect();
    let clause = "Splat Composition";
    let negative = || vec![Gaussian::new([-0.8, 0.3, 0.2]), Gaussian::new([0.9, 0.9, 0.9]).at(0.0, 0.0, -0.6)];
    let bright = |color: [f64; 3]| [Gaussian::new(color).opaque(0.4), Gaussian::new(BLUE).at(0.3, 0.0, -0.5)];
    vec![
        case(
            "sort-distance",
            Normative,
            "Sorting Method: cameraDistance",
            "Sorted by the distance from the camera.",
            file(sorted()).with("sortingMethod", "cameraDistance"),
        )
        .deciding(&[Freedom::Order])
        .unlike_rules("sorted by depth", |state| Freedom::Order.taken(state)),
        case(
            "sort-default",
            Normative,
            "Extending Mesh Primitives: sortingMethod",
            "Sorted by distance by default.",
            file(sorted()),
        )
        .deciding(&[Freedom::Order])
        .unlike_rules("sorted by depth", |state| Freedom::Order.taken(state)),
        case(
            "projection-perspective",
            Normative,
            "Projection",
            "The one value of projection.",
            file([turned()]).with("projection", "perspective"),
        ),
        case(
            "blend-two",
            Normative,
            clause,
            "The nearer one over the farther, whatever their places in the file.",
            file(stack(&[BLUE, RED]).into_iter().rev()),
        )
        .unlike(
            "the order of the file",
            Source::Gltf(file(stack(&[BLUE, RED]).into_iter().rev().enumerate().map(|(index, one)| {
                let [x, y, _] = one.position;
                one.at(x, y, -0.4 * index as f32)
            }))),
        ),
        case("blend-twelve", Normative, clause, "Twelve layers.", file(layers)),
        case("color-negative", Normative, "Splat Composition: c", "Channels below 0 count as 0.", file(negative()))
            .unlike(
                "the absolute value",
                Source::Gltf(file({
                    let mut gaussians = negative();
                    gaussians[0] = Gaussian::new([0.8, 0.3, 0.2]);
                    gaussians
                })),
            ),
        case(
            "color-bright",
            Normative,
            clause,
            "Channels above 1 are weighted as they are.",
            file(bright([2.0, 0.4, 0.2])),
        )
        .unlike("channels of at most 1", Source::Gltf(file(bright([1.0, 0.4, 0.2])))),
        case(
            "color-linear",
            Normative,
            "Color Space",
            "Blended in linear light, as the file says.",
            file(stack(&[RED, GREEN, BLUE])).with("colorSpace", "lin_rec709_display"),
        ),
        case(
            "color-srgb",
            Normative,
            "Color Space",
            "Blended as sRGB, as the file says.",
            file(stack(&[RED, GREEN, BLUE])),
        ),
    ]
}

/// The assumptions of the text, and the choices that it leaves open.
fn open() -> Vec<Case> {
    let large = || Gaussian::new([0.9; 3]).scaled(0.45, 0.35, 0.4).opaque(0.98);
    let small = || Gaussian::new(RED).scaled(0.02, 0.02, 0.02);
    let layers = || {
        let flat = |color: [f64; 3]| Gaussian::new(color).scaled(2.0, 2.0, 2.0);
        [flat(RED).opaque(1.0), flat([6.0; 3]).at(0.0, 0.0, -0.5).opaque(0.9)]
    };
    vec![
        case(
            "cut-off",
            Recommended,
            "Ellipse Kernel Rendering",
            "Nothing is drawn beyond three standard deviations.",
            file([large()]),
        )
        .deciding(&[Freedom::CutOff, Freedom::LowPass])
        .unlike_rules("no cut-off", without_cut_off),
        case(
            "low-pass",
            Choice,
            "Ellipse Kernel Rendering: training's algorithm",
            "3DGS's filter of 0.3 px^2.",
            file([small()]),
        )
        .deciding(&[Freedom::LowPass])
        .unlike_rules("no filter", |state| Freedom::LowPass.taken(state)),
        case("ceiling", Choice, "Splat Composition: alpha", "Alpha is at most 0.99, as in 3DGS.", file(layers()))
            .deciding(&[Freedom::Ceiling])
            .unlike_rules("no greatest alpha", |state| Freedom::Ceiling.taken(state)),
        case(
            "floor",
            Choice,
            "Splat Composition: alpha",
            "Alphas below 1/255 are left out, as in 3DGS.",
            file((0..10).map(|index| {
                Gaussian::new([2.0; 3]).scaled(0.8, 0.8, 0.8).at(0.0, 0.0, -0.1 * index as f32).opaque(0.0055)
            })),
        )
        .deciding(&[Freedom::Floor])
        .unlike_rules("no least alpha", |state| Freedom::Floor.taken(state)),
        case(
            "wide",
            Choice,
            "Splat Projection: J",
            "Beyond 1.3 times the picture's half J is that of its edge.",
            file([Gaussian::new(GREEN).scaled(0.9, 0.3, 0.9).at(2.6, 0.0, 1.2)]),
        ),
        case(
            "near",
            Choice,
            "Splat Projection",
            "What is nearer than 0.2 is not drawn.",
            file([Gaussian::new(RED).at(0.0, 0.0, 3.9).scaled(0.01, 0.01, 0.01), Gaussian::new(BLUE)]),
        ),
    ]
}
