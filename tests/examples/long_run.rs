//! Draws 100,000 frames of small, recurring scenes on one device, and checks that memory does not grow and that
//! pictures are the same each time: `long_run [FRAMES]`.

use gaurast_tests::long_run;

fn main() {
    let frames = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let frames = frames.unwrap_or(100_000);
    let report = long_run::run(frames, |frame| {
        if frame % 10_000 == 0 {
            println!("frame {frame}");
        }
    });
    println!("{report:?}");
}
