//! Prints statistics of scene files as JSON, one line each: `cargo run -p gaurast-scene --example info -- FILES`.

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut code = ExitCode::SUCCESS;
    for path in std::env::args_os().skip(1) {
        match gaurast_scene::open(&path) {
            Ok(scene) => {
                let info = gaurast_scene::info::Info::new(&scene);
                println!("{}", serde_json::to_string(&info).expect("plain numbers"));
            }
            Err(error) => {
                eprintln!("{error}");
                code = ExitCode::FAILURE;
            }
        }
    }
    code
}
