//! The command line: a command and its arguments.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::args::{EXIT_CODES, RenderArguments};
use crate::compare::CompareArguments;
use crate::compare_drivers::CompareDriversArguments;
use crate::eval::EvalArguments;
use crate::info::InfoArguments;
use crate::sheet::ViewsArguments;
use crate::simulate::SimulateArguments;

/// Renders scenes of 3D Gaussians on a software Vulkan device with a Gaussian primitive topology.
///
/// Without a command, `gaurast` works as `gaurast render`: `gaurast scene.ply` draws that file, and `gaurast` alone
/// draws a generated garden.
#[derive(Parser)]
#[command(name = "gaurast", version, max_term_width = 100, after_help = EXIT_CODES)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

#[derive(Subcommand)]
pub enum Command {
    /// Draws a scene and writes pictures or a video
    Render(Box<RenderArguments>),
    /// Draws a scene from eight sides on one labelled sheet, to find its front
    Views(Box<ViewsArguments>),
    /// Measures the difference of two pictures, two folders of pictures, or a picture and a scene
    Compare(Box<CompareArguments>),
    /// Runs a program on this driver and on another one, and measures the differences of its pictures
    CompareDrivers(Box<CompareDriversArguments>),
    /// Measures a trained model against its photographs
    Eval(Box<EvalArguments>),
    /// Prints the contents of a scene
    Info(Box<InfoArguments>),
    /// Estimates the cost of a scene on the simulated hardware: time, energy, area
    Simulate(Box<SimulateArguments>),
    /// Prints the variables with which Vulkan programs run on this installation's driver, for a shell's eval
    Icd,
    /// Prints a script that completes this command's arguments in a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Writes manual pages
    Man {
        /// The folder for the pages
        folder: PathBuf,
    },
}

impl Default for Command {
    fn default() -> Self {
        Self::Render(Box::default())
    }
}

impl Arguments {
    /// Reads the command line. An invalid one ends the process with code 2.
    pub fn read() -> Self {
        Self::parse_from(with_command(std::env::args_os().collect()))
    }
}

/// The command line with `render` inserted if the command is missing: before options, and before a word that is or
/// looks like a file.
fn with_command(mut words: Vec<std::ffi::OsString>) -> Vec<std::ffi::OsString> {
    let Some(first) = words.get(1).cloned() else {
        return words;
    };
    let text = first.to_string_lossy();
    let own = ["-h", "--help", "-V", "--version", "help"].contains(&text.as_ref());
    let option = text.starts_with('-');
    let path = std::path::Path::new(&first);
    let file = path.extension().is_some() || text.contains('/') || path.exists();
    let command = <Arguments as clap::CommandFactory>::command();
    let known = command.get_subcommands().any(|c| c.get_name() == text);
    if !own && !known && (option || file) {
        words.insert(1, "render".into());
    }
    words
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn no_arguments_are_the_defaults_of_render() {
        let arguments = Arguments::parse_from(["gaurast", "render"]);
        let Some(Command::Render(parsed)) = arguments.command else {
            panic!("not render");
        };
        let default = RenderArguments::default();
        assert_eq!(parsed.output.output, default.output.output);
        assert_eq!(parsed.camera.view, default.camera.view);
        assert_eq!(parsed.report.quiet, default.report.quiet);
        let camera = &parsed.camera;
        assert!(parsed.scene.scenes.is_empty() && camera.size.is_none() && camera.fov.is_none());
    }

    #[test]
    fn a_file_or_an_option_means_render() {
        let words = |line: &str| {
            let words = line.split(' ').map(Into::into).collect();
            let words = with_command(words).into_iter();
            words.map(|word| word.into_string().expect("text")).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(words("gaurast"), "gaurast");
        assert_eq!(words("gaurast a.ply -q"), "gaurast render a.ply -q");
        assert_eq!(words("gaurast -o a.png"), "gaurast render -o a.png");
        assert_eq!(words("gaurast some/folder"), "gaurast render some/folder");
        for own in ["--help", "-V", "help render", "render a.ply", "simulate --paper", "paint"] {
            let line = format!("gaurast {own}");
            assert_eq!(words(&line), line);
        }
    }
}
