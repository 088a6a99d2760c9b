//! Pictures that PlayCanvas' splat-transform made, which `gaurast compare` holds against ours.

use std::process::Command;

use gaurast_runner::{Need, data};

/// A scene, its picture, and the position of the camera, which looks at the origin with y upwards.
struct Golden {
    scene: &'static str,
    picture: &'static str,
    eye: &'static str,
}

const TINY: Golden = Golden { scene: "reference/tiny.generated.ply", picture: "reference/tiny.webp", eye: "0,5,-8" };

const MID: Golden = Golden { scene: "reference/mid.generated.ply", picture: "reference/mid.webp", eye: "0,10,-15" };

impl Golden {
    fn needs(&self) -> [Need; 2] {
        [Need::Data(self.scene), Need::Data(self.picture)]
    }

    /// The PSNR in decibels that the command finds with these options.
    fn psnr(&self, options: &[&str]) -> f64 {
        let output = Command::new(env!("CARGO_BIN_EXE_gaurast"))
            .arg("compare")
            .args([data(self.picture), data(self.scene)])
            .args(["--eye", self.eye, "--target", "0,0,0", "--up", "0,1,0", "--fov", "60", "--json"])
            .args(options)
            .output()
            .expect("the command starts");
        let json = String::from_utf8_lossy(&output.stdout);
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        json["pictures"][0]["psnr"].as_f64().expect("a number")
    }

    /// Checks that at least these are found: as 3DGS draws, and with the cut-off at 3 standard deviations that the
    /// other renderer has, too.
    fn check(&self, plain: f64, cut_off: f64) {
        let found = (self.psnr(&[]), self.psnr(&["--as", "gltf"]));
        assert!(found.0 >= plain && found.1 >= cut_off, "{found:?}");
    }
}

#[gaurast_runner::test(needs = TINY.needs())]
fn tiny_is_as_playcanvas_drew_it() {
    TINY.check(47.5, 48.0);
}

#[gaurast_runner::test(needs = MID.needs())]
fn mid_is_as_playcanvas_drew_it() {
    MID.check(40.7, 41.5);
}
