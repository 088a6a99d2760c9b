//! `registry-gen PATH/vk.xml` writes the driver's generated files.

use registry_gen::{Error, generate, repository};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(vk_xml) = std::env::args_os().nth(1) else {
        eprintln!("usage: registry-gen PATH/vk.xml, which driver/gen/fetch.sh gets");
        return ExitCode::FAILURE;
    };
    match write(Path::new(&vk_xml)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write(vk_xml: &Path) -> Result<(), Error> {
    for file in generate(repository(), vk_xml)? {
        let path = repository().join(file.path);
        std::fs::write(&path, file.text).map_err(|source| Error::File { path, source })?;
    }
    Ok(())
}
