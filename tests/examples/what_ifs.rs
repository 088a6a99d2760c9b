//! Prints the saving of each of the device's skips as hardware (`simdevice/timing/studies/WHAT_IF.md`). `what_ifs
//! FOLDER` also writes pictures of the scenes.

use gaurast_testkit::for_people;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (text, scenes) = gaurast_tests::what_ifs::markdown();
    print!("{text}");
    if let Some(folder) = std::env::args().nth(1) {
        for (number, scene) in scenes.iter().enumerate() {
            let path = std::path::Path::new(&folder).join(format!("what_if {number}.png"));
            for_people(&scene.pictures[0]).save(path)?;
        }
    }
    Ok(())
}
