//! Skipping of Gaussians that others hide.

use super::drawing::{Change, draw, walled};
use simdevice::Packet;
use simdevice::format::ClearValue;
use simdevice::packet::LoadOp;
use simdevice::state::gaussian::{CameraModel, GaussianLinearization};
use simdevice::state::{CompareOp, DepthTest, Rect};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::optimizations::{Optimization, Optimizations};
use std::sync::Arc;

#[gaurast_runner::test]
fn what_is_hidden_changes_no_bit() {
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let changes: [(&str, Change, bool); 8] = [
        ("as ever", |_| {}, true),
        (
            "parallel",
            |begin| {
                begin.camera.model = CameraModel::Orthographic;
                begin.camera.focal_length = [60.0; 2];
            },
            true,
        ),
        (
            "unscented",
            |begin| {
                Arc::make_mut(&mut begin.state).linearization = GaussianLinearization::Unscented;
            },
            true,
        ),
        (
            "compensated, without a filter",
            |begin| {
                let state = Arc::make_mut(&mut begin.state);
                (state.opacity_compensated, state.low_pass_variance) = (true, 0.0);
            },
            true,
        ),
        (
            "a scissor",
            |begin| {
                begin.scissor = Rect { x: 21, y: 17, width: 61, height: 43 };
            },
            true,
        ),
        ("a lower floor", |begin| Arc::make_mut(&mut begin.state).transmittance_floor = 1e-9, true),
        ("no floor", |begin| Arc::make_mut(&mut begin.state).transmittance_floor = 0.0, false),
        (
            "tested",
            |begin| {
                Arc::make_mut(&mut begin.state).depth_stencil.depth =
                    Some(DepthTest { compare: CompareOp::Less, write: false });
            },
            false,
        ),
    ];
    for (seed, (name, change, hides)) in changes.into_iter().enumerate() {
        let mut hidden = 0;
        for (right, opacity) in [(1.3, 0.99), (0.0, 0.95), (0.5, 0.7)] {
            let mut packets = walled(30 + seed as u64, right, opacity);
            if let Packet::GaussianBegin(begin) = &mut packets[0] {
                change(begin);
            }
            let (image, counters) = draw(Optimizations::ALL, &packets, over_black);
            let (other, without) =
                draw(Optimizations::ALL.without(Optimization::OcclusionCulling), &packets, over_black);
            assert!(image == other, "{name}, {right}");
            hidden += counters.get(Counter::HiddenByOthers);
            let read = |counters: &Counters| counters.get(Counter::GaussiansRead);
            assert_eq!(read(&counters), read(&without), "{name}, {right}");
        }
        assert_eq!(hidden > 0, hides, "{name}: {hidden}");
    }
}
