//! `gaurast views`: a scene from eight sides, to find its front.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use gaurast_picture::{Background, OutputError, Picture, Size};
use gaurast_scene::camera::{CameraError, DEFAULT_FOV};
use gaurast_scene::{DEFAULT_UP, Framing, Subject};
use thiserror::Error;

use crate::args::{ModeArguments, SceneArguments, Triple};
use crate::cameras::View;
use crate::devices;
use crate::drawing::{self, DrawError, Drawing};
use crate::progress::Progress;
use crate::sources::{Source, SourceError};

/// The azimuths of the sheet, in rows.
const AZIMUTHS: [[u16; 4]; 2] = [[0, 45, 90, 135], [180, 225, 270, 315]];

/// The default size of one view.
const CELL: [u32; 2] = [480, 360];

/// A failure to make the sheet. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: it is there already: --force replaces it", path.display())]
    There { path: PathBuf },
    #[error("the sheet is written, but not the report: {0}")]
    Report(std::io::Error),
}

#[derive(Args)]
pub struct ViewsArguments {
    #[command(flatten)]
    pub scene: SceneArguments,

    /// The upward direction of the scene [default: 0,-1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub up: Option<Triple>,

    /// Degrees above the horizon [default: 18.3]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    pub elevation: Option<f64>,

    /// The size of one of the eight views in pixels [default: 480x360]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// The background of the scene: a name, #rgb, #rrggbb, or R,G,B, each 0 to 1
    #[arg(long, value_name = "COLOUR")]
    pub background: Option<Background>,

    #[command(flatten)]
    pub modes: ModeArguments,

    /// The file for the sheet [default: the scene's name with -views.png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Replace an existing file that --output names; the default one is replaced without it
    #[arg(long)]
    pub force: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Draws the sheet.
pub fn run(arguments: &ViewsArguments) -> Result<(), Error> {
    if devices::list(&arguments.modes).map_err(DrawError::Device)? {
        return Ok(());
    }
    let source = Source::of(&arguments.scene)?;
    let path = match &arguments.output {
        Some(path) => path.clone(),
        None => format!("{}-views.png", source.name).into(),
    };
    gaurast_picture::check(&path)?;
    // The default file is replaced without asking.
    if path.is_file() && arguments.output.is_some() && !arguments.force {
        return Err(Error::There { path });
    }
    let progress = Progress { quiet: arguments.quiet };
    let (scene, _) = source.load(progress)?;
    let subject = Subject::of(&scene);
    let size = arguments.size.map_or(CELL, |size| size.0);
    let camera = |azimuth: &u16| {
        let framing = Framing {
            azimuth: Some((*azimuth).into()),
            elevation: arguments.elevation,
            up: arguments.up.map_or(DEFAULT_UP, |up| up.0),
            ..Framing::new(DEFAULT_FOV, size)
        };
        framing.camera(&subject)
    };
    let cameras = AZIMUTHS.as_flattened().iter().map(camera).collect::<Result<Vec<_>, _>>()?;
    if !arguments.quiet {
        for note in drawing::notes(&arguments.modes, &scene, scene.sh_degree()) {
            eprintln!("gaurast: {note}");
        }
    }
    let settings = drawing::settings(&arguments.modes, &scene, &cameras);
    let mut drawing = Drawing::new(scene.into(), settings, arguments.modes.device.as_deref(), false, None)?;
    let background = arguments.background.or(source.background);
    let behind = background.map_or([0.0; 3], Background::color);
    let bar = progress.pictures(8);
    let mut sheet = Sheet::new(size, [4, 2]);
    for (row, azimuths) in AZIMUTHS.iter().enumerate() {
        for (column, azimuth) in azimuths.iter().enumerate() {
            let view = View { name: None, camera: cameras[row * azimuths.len() + column].clone() };
            let frame = drawing.frame(&view)?;
            let cell = [column as u32, row as u32];
            sheet.put(cell, &frame.picture.over(behind));
            sheet.label(cell, &format!("azimuth {azimuth}"));
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    gaurast_picture::write(&path, &sheet.picture, None)?;
    if !arguments.quiet {
        let scenes = arguments.scene.scenes.iter();
        let scene: String = scenes.map(|scene| format!(" {}", scene.display())).collect();
        let mut stdout = std::io::stdout().lock();
        writeln!(
            stdout,
            "wrote {}: eight sides; `gaurast render{scene} --azimuth 45` draws the second",
            path.display()
        )
        .map_err(Error::Report)?;
    }
    Ok(())
}

/// Pictures of one size in rows.
struct Sheet {
    cell: [u32; 2],
    picture: Picture,
}

/// The size in pixels of a dot of a letter.
const DOT: u32 = 2;

impl Sheet {
    fn new(cell: [u32; 2], [columns, rows]: [u32; 2]) -> Self {
        let (width, height) = (cell[0] * columns, cell[1] * rows);
        Self { cell, picture: Picture { width, height, pixels: vec![[0.0, 0.0, 0.0, 1.0]; (width * height) as usize] } }
    }

    fn put(&mut self, cell: [u32; 2], picture: &Picture) {
        let width = picture.width as usize;
        for (y, row) in picture.pixels.chunks_exact(width).enumerate() {
            let left = (cell[0] * self.cell[0]) as usize;
            let top = (cell[1] * self.cell[1]) as usize;
            let start = (top + y) * self.picture.width as usize + left;
            self.picture.pixels[start..start + width].copy_from_slice(row);
        }
    }

    /// Writes a text in the upper left corner of a cell, white on black, and cuts it off at the cell's edge.
    fn label(&mut self, cell: [u32; 2], text: &str) {
        let [left, top] = [cell[0] * self.cell[0], cell[1] * self.cell[1]];
        let size = [6 * DOT * text.len() as u32 + DOT, 9 * DOT];
        for y in 0..size[1].min(self.cell[1]) {
            for x in 0..size[0].min(self.cell[0]) {
                let (column, row) = (x / DOT, y / DOT);
                let letter = column.checked_sub(1).map(|column| (column / 6, column % 6));
                let dot = letter.zip(row.checked_sub(1)).is_some_and(|((index, dot), row)| {
                    let glyph = text.chars().nth(index as usize).map_or([0; 7], glyph);
                    dot < 5 && glyph.get(row as usize).is_some_and(|r| r >> (4 - dot) & 1 == 1)
                });
                let shade = if dot { 1.0 } else { 0.0 };
                let at = (top + y) * self.picture.width + left + x;
                self.picture.pixels[at as usize] = [shade, shade, shade, 1.0];
            }
        }
    }
}

/// A letter of the labels: seven rows of five dots.
fn glyph(letter: char) -> [u8; 7] {
    match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        'a' => [0b00000, 0b00000, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111],
        'h' => [0b10000, 0b10000, 0b10110, 0b11001, 0b10001, 0b10001, 0b10001],
        'i' => [0b00100, 0b00000, 0b01100, 0b00100, 0b00100, 0b00100, 0b01110],
        'm' => [0b00000, 0b00000, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101],
        't' => [0b01000, 0b01000, 0b11100, 0b01000, 0b01000, 0b01001, 0b00110],
        'u' => [0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10011, 0b01101],
        'z' => [0b00000, 0b00000, 0b11111, 0b00010, 0b00100, 0b01000, 0b11111],
        _ => [0; 7],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_of_the_labels_has_a_glyph() {
        for azimuth in AZIMUTHS.as_flattened() {
            for letter in format!("azimuth{azimuth}").chars() {
                assert!(glyph(letter).iter().any(|row| *row != 0), "{letter}");
            }
        }
    }

    #[test]
    fn labels_stay_in_their_cells() {
        let mut sheet = Sheet::new([40, 12], [4, 2]);
        let grey = Picture { width: 40, height: 12, pixels: vec![[0.5; 4]; 480] };
        for column in 0..4 {
            for row in 0..2 {
                sheet.put([column, row], &grey);
            }
        }
        sheet.label([1, 1], "azimuth 45");
        let changed = |x: u32, y: u32| sheet.picture.pixels[(y * 160 + x) as usize] != [0.5; 4];
        for y in 0..24 {
            for x in 0..160 {
                let inside = (40..80).contains(&x) && (12..24).contains(&y);
                assert!(inside || !changed(x, y), "{x} {y}");
            }
        }
        assert!(changed(42, 14));
    }
}
