//! Draws 100,000 frames of tiny scenes that come again and again on one device, and checks that memory and pictures stay
//! as they are: `long_run [FRAMES]`.

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
