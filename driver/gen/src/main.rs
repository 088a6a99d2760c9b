//! `registry-gen PATH/vk.xml PATH/spirv.core.grammar.json` writes the driver's generated files.

use registry_gen::{Error, File, generate, generate_grammar, repository};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [vk_xml, grammar] = arguments.as_slice() else {
        eprintln!("usage: registry-gen PATH/vk.xml PATH/spirv.core.grammar.json, which driver/gen/fetch.sh gets");
        return ExitCode::FAILURE;
    };
    match write(Path::new(vk_xml), Path::new(grammar)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write(vk_xml: &Path, grammar: &Path) -> Result<(), Error> {
    let mut files: Vec<File> = generate(repository(), vk_xml)?;
    files.push(generate_grammar(grammar)?);
    for file in files {
        let path = repository().join(file.path);
        std::fs::write(&path, file.text).map_err(|source| Error::File { path, source })?;
    }
    Ok(())
}
