//! Cases of OpenUSD's `ParticleField3DGaussianSplat`, from the schemas of UsdVol in release [`TEXT`].

use crate::case::{Case, Freedom, Level, Source, aslant};
use crate::gaussian::Gaussian;
use crate::usd_file::Usd;

/// The release of OpenUSD whose schemas say what is drawn.
pub const TEXT: &str = "26.03";

const RED: [f64; 3] = [0.9, 0.2, 0.1];
const GREEN: [f64; 3] = [0.1, 0.8, 0.3];
const BLUE: [f64; 3] = [0.2, 0.3, 0.9];

use Level::{Normative, Recommended};

fn file(gaussians: impl IntoIterator<Item = Gaussian>) -> Usd {
    Usd::new(gaussians.into_iter().collect())
}

fn one(gaussian: Gaussian) -> Source {
    Source::Usd(file([gaussian]))
}

fn turned() -> Gaussian {
    Gaussian::new(RED).scaled(0.7, 0.3, 0.45).turned([1.0, 2.0, 3.0], 50.0)
}

fn case(name: &str, level: Level, clause: &'static str, shows: &'static str, usd: Usd) -> Case {
    Case::of_format(name, level, clause, shows, Source::Usd(usd))
}

/// The cases.
pub fn all() -> Vec<Case> {
    let mut cases = attributes();
    cases.extend(transforms());
    cases.extend(hints());
    cases
}

fn attributes() -> Vec<Case> {
    let shown = [Gaussian::new(RED).at(-0.9, 0.5, 0.0), Gaussian::new(GREEN).at(0.6, -0.4, -0.5)];
    let upside_down = [Gaussian::new(RED).at(-0.9, -0.5, 0.0), Gaussian::new(GREEN).at(0.6, 0.4, -0.5)];
    let [x, y, z, w] = turned().rotation;
    let faint = || Gaussian::new(BLUE).opaque(0.35);
    let sigmoid = (1.0 / (1.0 + libm::exp(-0.35))) as f32;
    let lit = |degree: u32| {
        let grey = Gaussian::new([0.5, 0.4, 0.6]).scaled(0.6, 0.6, 0.6);
        [
            grey.clone().at(-0.6, 0.3, 0.0).with_harmonics(degree, 0.7),
            grey.at(0.9, -0.4, -1.5).with_harmonics(degree, -0.7),
        ]
    };
    let plain = |degree: u32| lit(degree).map(|one| Gaussian { harmonics: vec![one.harmonics[0]], ..one });
    let harmonics = "ParticleFieldSphericalHarmonicsAttributeAPI";
    let halves = || file([turned(), Gaussian::new(BLUE).at(0.75, -0.5, -0.5)]);
    let mut cases = vec![
        case("positions", Normative, "ParticleFieldPositionAttributeAPI", "Centres, with y upwards.", file(shown))
            .unlike("y downwards", Source::Usd(file(upside_down))),
        case(
            "scales",
            Normative,
            "ParticleFieldScaleAttributeAPI",
            "Scales are linear.",
            file([Gaussian::new(RED).scaled(0.7, 0.25, 0.4)]),
        )
        .unlike("the scales are logarithms", one(Gaussian::new(RED).scaled(2.01, 1.28, 1.49))),
        case(
            "orientations",
            Normative,
            "ParticleFieldOrientationAttributeAPI",
            "Text has a quaternion's real part first.",
            file([turned()]),
        )
        .unlike("quaternions are x, y, z, w", one(turned().with_rotation([y, z, w, x]))),
        case(
            "orientations-sense",
            Normative,
            "ParticleFieldOrientationAttributeAPI",
            "The rotation takes the kernel's axes to the prim's.",
            file([turned()]),
        )
        .seen_by(aslant())
        .unlike("the inverse rotation", one(turned().with_rotation([-x, -y, -z, w]))),
        case("opacities", Normative, "ParticleFieldOpacityAttributeAPI", "Opacities are linear.", file([faint()]))
            .unlike("the opacity is a logit", one(faint().opaque(sigmoid))),
        case(
            "half",
            Normative,
            "ParticleField3DGaussianSplat: half attributes",
            "Every attribute in binary16.",
            halves().half(),
        ),
        case(
            "float-first",
            Normative,
            "ParticleFieldOpacityAttributeAPI: float is preferred",
            "Both precisions, of which binary32 counts.",
            file([faint()]).with("half[] opacitiesh = [0.9]"),
        )
        .unlike("binary16", one(faint().opaque(0.9))),
        case(
            "harmonics-0",
            Normative,
            harmonics,
            "Degree 0.",
            file([Gaussian { harmonics: vec![[1.2, -0.8, 0.3]], ..faint() }]),
        )
        .unlike("the coefficients are the colour", one(Gaussian::new([1.2, -0.8, 0.3]).opaque(0.35))),
        case(
            "kernel",
            Normative,
            "ParticleFieldKernelGaussianEllipsoidAPI",
            "The falloff of a Gaussian, times the opacity.",
            file([Gaussian::new([0.9; 3]).scaled(0.6, 0.45, 0.5).opaque(0.9)]),
        )
        .unlike("a deviation for a variance", one(Gaussian::new([0.9; 3]).scaled(0.77, 0.67, 0.71).opaque(0.9))),
    ];
    for (degree, name) in [(1, "harmonics-1"), (2, "harmonics-2"), (3, "harmonics-3")] {
        cases.push(
            case(name, Normative, harmonics, "All functions up to a degree, seen aslant.", file(lit(degree)))
                .seen_by(aslant())
                .unlike("degree 0 alone", Source::Usd(file(plain(degree)))),
        );
    }
    cases
}

fn transforms() -> Vec<Case> {
    let clause = "UsdGeomXformable: xformOpOrder";
    let mesh = || file([turned().at(0.2, 0.1, 0.1)]);
    let untouched = || Source::Usd(mesh());
    let moved =
        ["double3 xformOp:translate = (0.6, -0.4, 0.5)", "uniform token[] xformOpOrder = [\"xformOp:translate\"]"];
    let ordered = [
        "double3 xformOp:translate = (0.5, -0.25, 0)",
        "float xformOp:rotateZ = 45",
        "float3 xformOp:scale = (1.5, 0.75, 1)",
        "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateZ\", \"xformOp:scale\"]",
    ];
    let other_order = [
        ordered[0],
        ordered[1],
        ordered[2],
        "uniform token[] xformOpOrder = [\"xformOp:scale\", \"xformOp:rotateZ\", \"xformOp:translate\"]",
    ];
    let on_prim = |lines: &[&str]| lines.iter().fold(mesh(), |usd, line| usd.with(line));
    let lit = || Gaussian::new([0.5; 3]).scaled(0.5, 0.5, 0.5).with_harmonics(1, 1.0);
    // With z upwards, the picture is that of y upwards in turned coordinates.
    let upright = [Gaussian::new(RED).at(-0.9, 0.0, 0.5), Gaussian::new(GREEN).at(0.6, 0.5, -0.4)];
    vec![
        case("xform", Normative, clause, "A prim that moves.", on_prim(&moved)).unlike("no transform", untouched()),
        case("xform-order", Normative, clause, "The last operation comes first.", on_prim(&ordered))
            .unlike("the first operation comes first", Source::Usd(on_prim(&other_order))),
        case("xform-parents", Normative, clause, "A prim within two others.", mesh().within(&ordered).within(&moved))
            .unlike("the inner one alone", Source::Usd(mesh().within(&ordered))),
        case(
            "xform-harmonics",
            Recommended,
            "ParticleFieldSphericalHarmonicsAttributeAPI: local space",
            "Harmonics turn with the prim.",
            file([lit()])
                .with("float xformOp:rotateY = 90")
                .with("uniform token[] xformOpOrder = [\"xformOp:rotateY\"]"),
        )
        .seen_by(aslant())
        .unlike("harmonics that stay", one(lit())),
        case("up-axis", Recommended, "UsdGeom: upAxis", "z is upwards.", Usd { up: 'Z', ..file(upright.clone()) })
            .unlike("y is upwards", Source::Usd(file(upright))),
    ]
}

fn hints() -> Vec<Case> {
    let clause = "ParticleField3DGaussianSplat: sortingModeHint";
    // By distance the left one is in front; by depth, the right one.
    let sorted =
        || file([Gaussian::new(RED).at(0.2, 0.0, 0.0), Gaussian::new(GREEN).at(1.3, 0.0, 0.15).scaled(0.5, 0.5, 0.5)]);
    vec![
        case("sort-default", Recommended, clause, "Sorted by depth without a hint.", sorted())
            .deciding(&[Freedom::Order])
            .unlike_rules("sorted by distance", |state| Freedom::Order.taken(state)),
        case("sort-depth", Recommended, clause, "zDepth.", sorted().with("uniform token sortingModeHint = \"zDepth\""))
            .deciding(&[Freedom::Order])
            .unlike_rules("sorted by distance", |state| Freedom::Order.taken(state)),
        case(
            "sort-distance",
            Recommended,
            clause,
            "cameraDistance.",
            sorted().with("uniform token sortingModeHint = \"cameraDistance\""),
        )
        .deciding(&[Freedom::Order])
        .unlike_rules("sorted by depth", |state| Freedom::Order.taken(state)),
        case(
            "projection-perspective",
            Recommended,
            "ParticleField3DGaussianSplat: projectionModeHint",
            "perspective.",
            file([turned()]).with("uniform token projectionModeHint = \"perspective\""),
        ),
    ]
}
