//! Values that tests compute once for all SIMD levels, such as the oracle's pictures.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Values that every SIMD level of a test requests once, by name. The first request computes a value, and the last one
/// removes it.
#[derive(Default)]
pub struct ForLevels<T>(Mutex<Option<HashMap<String, Shared<T>>>>);

/// A value, or its computation in progress, and the number of levels that have not requested it yet.
struct Shared<T> {
    value: Arc<OnceLock<Arc<T>>>,
    left: usize,
}

impl<T> ForLevels<T> {
    /// An empty set of values.
    pub const fn new() -> Self {
        Self(Mutex::new(None))
    }

    /// The value of `name`; `make` computes it if there is none.
    pub fn get(&self, name: &str, make: impl FnOnce() -> T) -> Arc<T> {
        let value = self.ask(name);
        Arc::clone(value.get_or_init(|| Arc::new(make())))
    }

    fn ask(&self, name: &str) -> Arc<OnceLock<Arc<T>>> {
        let mut values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let values = values.get_or_insert_default();
        let shared =
            values.entry(name.to_owned()).or_insert_with(|| Shared { value: Arc::default(), left: levels().len() });
        shared.left -= 1;
        let value = Arc::clone(&shared.value);
        if shared.left == 0 {
            values.remove(name);
        }
        value
    }
}

/// The SIMD levels that this processor supports, the simplest first.
pub fn levels() -> Vec<&'static str> {
    let all = gaurast_runner::SIMD_LEVELS.into_iter();
    all.filter(|level| gaurast_runner::has_simd_level(level)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_for_all_levels_and_then_forgotten() {
        let values = ForLevels::new();
        let mut made = 0;
        for _ in levels() {
            let value = values.get("a", || {
                made += 1;
                7
            });
            assert_eq!(*value, 7);
        }
        assert_eq!(made, 1);
        assert_eq!(*values.get("a", || 8), 8);
        assert_eq!(*values.get("b", || 9), 9);
    }
}
