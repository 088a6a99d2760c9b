//! Attributes that are decoded from the codes of compressed files.

use ash::vk;
use gaurast::vk::{
    GaussianDecodingTablesGAURAST as Tables, GaussianGeometryGAURAST as Geometry,
    GaussianRotationDecodingGAURAST as RotationDecoding, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_oracle::oracle::decoding::{opacity_of_decoded_logit, scale_of_decoded_logarithm};
use gaurast_testkit::Commands;

use super::chapter::Chapter;
use super::coded::{CodeStrides, Coded, Layout, Numbers};
use super::input::{placed, placements, vertices};
use super::scenes::{dense, part};
use crate::draw::{Call, Draw};
use crate::program::Program;
use crate::stage::Stage;

const NUMBERS: [(&str, Numbers); 2] = [("binary32", Numbers::Binary32), ("binary64", Numbers::Binary64)];

/// A function that makes the codes of a file.
type MakeCodes = fn() -> Coded;

fn identity(value: f64) -> f64 {
    value
}

fn rounded(value: f64) -> f32 {
    value as f32
}

fn logit(opacity: f64) -> f64 {
    let opacity = opacity.clamp(0.001, 0.999);
    (opacity / (1.0 - opacity)).ln()
}

/// Records a binding of tables.
fn bind(commands: &Commands, tables: &Tables<'_>) {
    let gaussian = commands.gpu().gaussian().expect("a device that draws Gaussians");
    // SAFETY: the buffer lives until the commands have run.
    unsafe { gaussian.cmd_bind_gaussian_decoding_tables(commands.raw, tables) };
}

/// Binds the codes' vertex buffers and their tables, and records.
fn run(stage: &Stage<'_>, coded: &Coded, record: impl Fn(&Commands)) {
    let buffers = coded.buffers(stage.gpu);
    let (_tables, bound) = coded.bound(stage.gpu);
    stage.run(|commands| {
        for (binding, buffer) in &buffers {
            commands.vertex_buffer(*binding, buffer, 0);
        }
        bind(commands, &bound);
        record(commands);
    });
}

/// A program that draws codes as `draw` draws the scene that they stand for.
fn coded(draw: Draw, coded: Coded, record: impl Fn(&Commands) + Send + Sync + 'static) -> Program {
    let draw = Draw { scene: coded.scene.clone(), ..draw };
    let changed = coded.clone();
    Program::changed(draw, move |graphics| changed.change(graphics), move |stage| run(stage, &coded, &record))
        .needing("attributeDecoding")
}

/// The same with one draw of all codes.
fn whole(draw: Draw, all: Coded) -> Program {
    let count = all.scene.positions.len() as u32;
    coded(draw, all, move |commands| commands.draw(0..count))
}

/// The codes of a compressed PLY: words, chunks, and bytes of harmonics by component.
fn as_in_ply(seed: u64, degree: u32, chunk: usize) -> Coded {
    let coefficients = (degree as usize + 1).pow(2) - 1;
    let all = Coded::new(dense(seed, degree))
        .positions(Layout::Word, Numbers::Binary32, chunk, false)
        .scales(Layout::Word, Numbers::Binary32, chunk, f64::ln, scale_of_decoded_logarithm)
        .rotations(RotationDecoding::SMALLEST_THREE_10)
        .colors(Some(chunk), Numbers::Binary32);
    match degree {
        0 => all,
        _ => all.harmonics(CodeStrides::by_component(coefficients), Numbers::Binary32),
    }
}

/// The codes of a SOG: one chunk of signed logarithms, codebooks, and a palette.
fn as_in_sog(seed: u64, degree: u32) -> Coded {
    let coefficients = (degree as usize + 1).pow(2) - 1;
    let all = Coded::new(dense(seed, degree))
        .positions(Layout::Halves, Numbers::Binary64, 500, true)
        .scale_book(Numbers::Binary64, f64::ln, scale_of_decoded_logarithm)
        .rotations(RotationDecoding::SMALLEST_THREE_8)
        .colors(None, Numbers::Binary64);
    match degree {
        0 => all,
        _ => all.palette(CodeStrides::by_coefficient(coefficients, 1), Numbers::Binary64, 90),
    }
}

/// A draw of files' codes, whose scales are logarithms.
fn of_file() -> Draw {
    Draw::new(dense(1, 0)).in_state(|state| state.flags(Flags::LOG_SCALE))
}

/// The draw `draw` of a scene of this degree.
fn of_degree(draw: Draw, degree: u32) -> Draw {
    Draw { degree, ..draw }
}

pub(super) fn decoding(chapter: &mut Chapter<'_>) {
    attributes(chapter);
    harmonics(chapter);
    files(chapter);
    ends(chapter);
}

/// Each attribute by each decoding.
fn attributes(chapter: &mut Chapter<'_>) {
    let plain = || Draw::new(dense(1, 0));
    for (numbers_name, numbers) in NUMBERS {
        for (layout_name, layout) in [("word", Layout::Word), ("bytes", Layout::Bytes), ("halves", Layout::Halves)] {
            for size in [1, 32, 256, 500, 1000] {
                let name = format!("position.{layout_name}.chunks_of_{size}.{numbers_name}");
                chapter.program(name, move || {
                    whole(plain(), Coded::new(dense(471, 0)).positions(layout, numbers, size, false))
                });
            }
            chapter.program(format!("position.{layout_name}.signed_log.{numbers_name}"), move || {
                whole(plain(), Coded::new(dense(472, 0)).positions(layout, numbers, 500, true))
            });
            chapter.program(format!("scale.{layout_name}.chunks.{numbers_name}"), move || {
                whole(plain(), Coded::new(dense(473, 0)).scales(layout, numbers, 64, identity, rounded))
            });
            chapter.program(format!("scale.{layout_name}.log_chunks.{numbers_name}"), move || {
                let coded = Coded::new(dense(474, 0));
                whole(of_file(), coded.scales(layout, numbers, 64, f64::ln, scale_of_decoded_logarithm))
            });
        }
        chapter.program(format!("scale.codebook.{numbers_name}"), move || {
            whole(plain(), Coded::new(dense(475, 0)).scale_book(numbers, identity, rounded))
        });
        chapter.program(format!("scale.log_codebook.{numbers_name}"), move || {
            let coded = Coded::new(dense(476, 0));
            whole(of_file(), coded.scale_book(numbers, f64::ln, scale_of_decoded_logarithm))
        });
        for (name, size) in [("codebook", None), ("chunks", Some(100))] {
            chapter.program(format!("opacity.{name}.{numbers_name}"), move || {
                whole(plain(), Coded::new(dense(477, 0)).opacities(size, numbers, identity, rounded))
            });
            chapter.program(format!("opacity.logit_{name}.{numbers_name}"), move || {
                let draw = plain().in_state(|state| state.flags(Flags::LOGIT_OPACITY));
                let coded = Coded::new(dense(478, 0));
                whole(draw, coded.opacities(size, numbers, logit, opacity_of_decoded_logit))
            });
        }
        for (name, size) in [("codebook", None), ("base_color_chunks", Some(77))] {
            chapter.program(format!("color.{name}.{numbers_name}"), move || {
                whole(of_degree(plain(), 1), Coded::new(dense(479, 1)).colors(size, numbers))
            });
        }
    }
    for (name, decoding) in
        [("word", RotationDecoding::SMALLEST_THREE_10), ("bytes", RotationDecoding::SMALLEST_THREE_8)]
    {
        chapter
            .program(format!("rotation.{name}"), move || whole(plain(), Coded::new(dense(480, 0)).rotations(decoding)));
    }
    chapter.program("surfel", move || {
        let draw = plain().in_state(|state| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(0.5));
        let coded = Coded::new(dense(481, 0));
        whole(draw, coded.scales(Layout::Word, Numbers::Binary32, 256, identity, rounded))
    });
}

/// Harmonics by bytes of each Gaussian and of a palette's entries.
fn harmonics(chapter: &mut Chapter<'_>) {
    for degree in 0..=4_u32 {
        let coefficients = (degree as usize + 1).pow(2) - 1;
        let draw = move || of_degree(Draw::new(dense(1, 0)), degree);
        for (name, strides) in [
            ("by_component", CodeStrides::by_component(coefficients)),
            ("by_coefficient", CodeStrides::by_coefficient(coefficients, 0)),
            ("padded", CodeStrides::by_coefficient(coefficients, 1)),
            ("far_apart", CodeStrides::by_coefficient(coefficients, 99)),
        ] {
            if degree == 0 {
                continue;
            }
            chapter.program(format!("harmonics.codebook.{name}.degree_{degree}"), move || {
                whole(draw(), Coded::new(dense(482, degree)).harmonics(strides, Numbers::Binary32))
            });
            chapter.program(format!("harmonics.palette.{name}.degree_{degree}"), move || {
                whole(draw(), Coded::new(dense(483, degree)).palette(strides, Numbers::Binary64, 64))
            });
        }
        chapter.program(format!("as_in_ply.degree_{degree}"), move || {
            whole(of_degree(of_file(), degree), as_in_ply(484, degree, 256))
        });
        chapter.program(format!("as_in_sog.degree_{degree}"), move || {
            whole(of_degree(of_file(), degree), as_in_sog(485, degree))
        });
    }
    chapter.program("drawn_of_lower_degree", move || whole(of_degree(of_file(), 1), as_in_sog(486, 3)));
}

/// The codes of files, by all ways of drawing vertices.
fn files(chapter: &mut Chapter<'_>) {
    let files: [(&str, MakeCodes); 2] = [("ply", || as_in_ply(487, 1, 64)), ("sog", || as_in_sog(488, 1))];
    for (name, file) in files {
        let draw = || of_degree(of_file(), 1);
        chapter.program(format!("first_vertex.{name}"), move || {
            let draw = Draw { calls: vec![vertices(170, 300)], ..draw() };
            coded(draw, file(), |commands| commands.draw(170..470))
        });
        chapter.program(format!("indices.{name}"), move || {
            let indices: Vec<u32> = (0..400).rev().step_by(3).chain(100..140).collect();
            let count = indices.len() as u32;
            let calls = vec![Call::Indexed { indices: [0, count], offset: 60 }];
            let draw = Draw { indices, calls, ..draw() };
            coded(draw, file(), move |commands| commands.draw_indexed(0..count, 60))
        });
        chapter.program(format!("instances.{name}"), move || {
            let of_instances = placed(vk::VertexInputRate::INSTANCE, placements(), 1);
            let draw = of_instances.in_state(|state| state.flags(Flags::LOG_SCALE));
            coded(draw, file(), |commands| commands.draw_instances(0..90, 0..6))
        });
        chapter.program(format!("again.{name}"), move || {
            // What a device keeps of codes must not outlive their tables.
            let draw = Draw { calls: vec![vertices(0, 500)], ..draw() };
            let shown = file();
            let other = match name {
                "ply" => as_in_ply(489, 1, 64),
                _ => as_in_sog(489, 1),
            };
            let draw = Draw { scene: shown.scene.clone(), ..draw };
            let changed = shown.clone();
            let program = Program::changed(
                draw,
                move |graphics| changed.change(graphics),
                move |stage| {
                    let buffers = shown.buffers(stage.gpu);
                    let (_first, bound) = shown.bound(stage.gpu);
                    let (_second, of_other) = other.bound(stage.gpu);
                    let record = |commands: &Commands, tables: &Tables<'_>| {
                        for (binding, buffer) in &buffers {
                            commands.vertex_buffer(*binding, buffer, 0);
                        }
                        bind(commands, tables);
                        commands.draw(0..500);
                    };
                    for _ in 0..3 {
                        stage.gpu.run(|commands| {
                            commands.pass(&stage.target, &gaurast_testkit::Pass::clear([0.0; 4]), || {
                                stage.bind(commands);
                                record(commands, &of_other);
                            });
                        });
                    }
                    stage.gpu.run(|commands| {
                        commands.pass(&stage.target, &gaurast_testkit::Pass::clear([0.0; 4]), || {
                            stage.bind(commands);
                            record(commands, &bound);
                        });
                    });
                },
            );
            program.needing("attributeDecoding")
        });
    }
    chapter.program("rebound", move || {
        let draw = Draw { calls: vec![vertices(0, 200), vertices(200, 300)], ..of_degree(of_file(), 1) };
        parts(draw, |_, draws| draws())
    });
}

/// A set whose draws have tables of their own, for the chapter of sets.
pub(super) fn in_a_set(chapter: &mut Chapter<'_>) {
    chapter.program("decoding_tables", move || {
        let draw = Draw { merged: true, ..of_degree(of_file(), 1) };
        parts(draw, |commands, draws| commands.gaussian_set(draws))
    });
}

/// A program that draws two parts of a scene, which have codes and tables of their own.
fn parts(draw: Draw, wrap: fn(&Commands, &dyn Fn())) -> Program {
    let file = |range| {
        Coded::new(part(&dense(490, 1), range))
            .positions(Layout::Word, Numbers::Binary32, 64, false)
            .scales(Layout::Word, Numbers::Binary32, 64, f64::ln, scale_of_decoded_logarithm)
            .rotations(RotationDecoding::SMALLEST_THREE_10)
            .opacities(None, Numbers::Binary32, identity, rounded)
            .colors(Some(64), Numbers::Binary32)
            .harmonics(CodeStrides::by_component(3), Numbers::Binary32)
    };
    let both = [file(0..200), file(200..500)];
    let mut scene = both[0].scene.clone();
    let second = &both[1].scene;
    scene.positions.extend(&second.positions);
    scene.scales.extend(&second.scales);
    scene.rotations.extend(&second.rotations);
    scene.opacities.extend(&second.opacities);
    scene.sh.extend(&second.sh);
    let changed = both[0].clone();
    let program = Program::changed(
        Draw { scene, ..draw },
        move |graphics| changed.change(graphics),
        move |stage| {
            let bound = both.each_ref().map(|part| (part.buffers(stage.gpu), part.bound(stage.gpu)));
            stage.run(|commands| {
                wrap(commands, &|| {
                    for ((buffers, (_, tables)), part) in bound.iter().zip(&both) {
                        for (binding, buffer) in buffers {
                            commands.vertex_buffer(*binding, buffer, 0);
                        }
                        bind(commands, tables);
                        commands.draw(0..part.scene.positions.len() as u32);
                    }
                });
            });
        },
    );
    program.needing("attributeDecoding")
}

/// Tables that end early: what does not lie in them whole is 0.
fn ends(chapter: &mut Chapter<'_>) {
    let draw = |degree| of_degree(Draw::new(dense(1, 0)), degree);
    for (numbers_name, numbers) in NUMBERS {
        // Chunks from the fourth on are not there, or not whole: their Gaussians are at the origin.
        for (name, extra) in [("whole", 0), ("in_part", 5 * numbers.bytes() as u64)] {
            chapter.program(format!("end.chunks.{name}.{numbers_name}"), move || {
                let mut all = Coded::new(dense(491, 0)).positions(Layout::Word, numbers, 64, false);
                all.places.position.size = 3 * u64::from(all.places.position.stride) + extra;
                all.scene.positions[3 * 64..].fill([0.0; 3]);
                whole(draw(0), all)
            });
        }
        for (name, extra) in [("whole", 0), ("in_part", numbers.bytes() as u64 - 1)] {
            chapter.program(format!("end.codebook.{name}.{numbers_name}"), move || {
                let mut all = Coded::new(dense(492, 0)).opacities(None, numbers, identity, rounded);
                let kept = 150;
                let numbers_kept = all.numbers_of_opacities(kept);
                all.places.opacity.size = kept as u64 * numbers.bytes() as u64 + extra;
                for (opacity, is_kept) in all.scene.opacities.iter_mut().zip(numbers_kept) {
                    *opacity = if is_kept { *opacity } else { 0.0 };
                }
                whole(draw(0), all)
            });
        }
    }
    // Codes of 300 Gaussians and 7 bytes, of 9 each.
    chapter.program("end.codes", move || {
        let mut all = Coded::new(dense(493, 1)).harmonics(CodeStrides::by_coefficient(3, 0), Numbers::Binary32);
        all.places.codes.size = 9 * 300 + 7;
        for (index, sh) in all.scene.sh.chunks_mut(4).enumerate() {
            for component in sh[1..].as_flattened_mut().iter_mut().enumerate() {
                if 9 * index + component.0 >= 9 * 300 + 7 {
                    *component.1 = 0.0;
                }
            }
        }
        whole(draw(1), all)
    });
    for (name, extra) in [("whole", 0), ("in_part", 1)] {
        chapter.program(format!("end.labels.{name}"), move || {
            let strides = CodeStrides::by_coefficient(3, 1);
            let mut all = Coded::new(dense(494, 1)).palette(strides, Numbers::Binary32, 70);
            all.places.labels.size = 4 * 200 + extra;
            for sh in all.scene.sh.chunks_mut(4).skip(200) {
                sh[1..].fill([0.0; 3]);
            }
            whole(draw(1), all)
        });
    }
    chapter.program("end.empty", move || {
        let mut all = Coded::new(dense(495, 0)).colors(None, Numbers::Binary32);
        all.places.color.size = 0;
        all.scene.sh.fill([0.0; 3]);
        whole(draw(0), all)
    });
}
