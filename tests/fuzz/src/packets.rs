//! Fuzz target: the bytes are decoded as packets of the simulated device.
#![no_main]

use gaurast_tests::fuzzing::packets::Player;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

fuzz_target!(|data: &[u8]| {
    static PLAYER: LazyLock<Player> = LazyLock::new(Player::new);
    PLAYER.run(data);
});
