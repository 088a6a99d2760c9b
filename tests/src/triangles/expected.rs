//! Two checked-in lists: expected differences from lavapipe, and scenes that this driver does not support.
//!
//! A scene that is listed as unsupported but is drawn correctly fails, so that the list stays up to date. An exception
//! may be unused on one machine, since lavapipe's rounding depends on the processor.

use std::path::Path;

use gaurast_testkit::Difference;

/// A difference that the specification permits.
#[derive(Clone, Debug, PartialEq)]
pub struct Exception {
    /// The scene.
    pub scene: String,
    /// The picture, or `*` for all of them.
    pub picture: String,
    /// The most texels that may differ.
    pub texels: usize,
    /// The greatest difference, in multiples of the format's limit.
    pub limits: f64,
    /// The clause of the specification that permits it.
    pub clause: String,
}

/// The two lists.
#[derive(Clone, Debug, Default)]
pub struct Expected {
    /// Differences that the specification permits.
    pub exceptions: Vec<Exception>,
    /// Scenes that this driver cannot draw yet, with the reasons.
    pub unsupported: Vec<(String, String)>,
}

impl Expected {
    /// Reads the lists.
    ///
    /// # Panics
    /// If a list is missing, or a line is invalid.
    pub fn read() -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("expected_failures");
        let read = |name| std::fs::read_to_string(folder.join(name)).expect("a checked-in list");
        Self::parse(&read("triangles.txt"), &read("triangles_not_supported_yet.txt"))
    }

    fn parse(exceptions: &str, unsupported: &str) -> Self {
        let exceptions = lines(exceptions).map(|fields| match fields[..] {
            [scene, picture, texels, limits, clause] if !clause.is_empty() => Exception {
                scene: scene.to_owned(),
                picture: picture.to_owned(),
                texels: texels.parse().expect("a number of texels"),
                limits: limits.parse().expect("a number of limits"),
                clause: clause.to_owned(),
            },
            _ => panic!("scene | picture | texels | limits | clause, not {fields:?}"),
        });
        let unsupported = lines(unsupported).map(|fields| match fields[..] {
            [scene, reason] if !reason.is_empty() => (scene.to_owned(), reason.to_owned()),
            _ => panic!("scene | reason, not {fields:?}"),
        });
        Self { exceptions: exceptions.collect(), unsupported: unsupported.collect() }
    }

    /// The reason for which a scene cannot be drawn yet, if it is listed.
    pub fn unsupported(&self, scene: &str) -> Option<&str> {
        let mut found = self.unsupported.iter().filter(|(name, _)| name == scene);
        found.next().map(|(_, reason)| reason.as_str())
    }

    /// The exceptions of a scene.
    pub fn exceptions(&self, scene: &str) -> impl Iterator<Item = &Exception> {
        let scene = scene.to_owned();
        (self.exceptions.iter()).filter(move |exception| exception.scene == scene)
    }

    /// The names of all listed scenes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let exceptions = self.exceptions.iter().map(|exception| &*exception.scene);
        exceptions.chain(self.unsupported.iter().map(|(name, _)| &**name))
    }
}

impl Exception {
    /// True if it applies to a picture.
    pub fn covers(&self, picture: &str) -> bool {
        self.picture == "*" || self.picture == picture
    }

    /// True if a difference of its picture is within its limits.
    pub fn excuses(&self, difference: &Difference) -> bool {
        self.covers(&difference.picture) && difference.texels <= self.texels && difference.worst <= self.limits
    }
}

/// The lines of a list, split at bars; lines that begin with `#` are comments.
fn lines(text: &str) -> impl Iterator<Item = Vec<&str>> {
    let lines = text.lines().map(str::trim);
    lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(|line| line.split('|').map(str::trim).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_become_exceptions_and_reasons() {
        let expected = Expected::parse(
            "# scene | picture | texels | limits | clause\nlines | color 0 | 3 | 1.5 | 28.6.1: may\n\n",
            "points | no points\n",
        );
        let exception = expected.exceptions("lines").next().unwrap();
        assert!(exception.covers("color 0") && !exception.covers("depth"));
        assert_eq!((exception.texels, &*exception.clause), (3, "28.6.1: may"));
        let difference = |texels, worst| Difference {
            picture: "color 0".to_owned(),
            texels,
            worst,
            place: [0; 2],
            components: Default::default(),
        };
        assert!(exception.excuses(&difference(3, 1.5)));
        assert!(!exception.excuses(&difference(4, 1.5)) && !exception.excuses(&difference(3, 1.6)));
        assert_eq!(expected.exceptions("points").count(), 0);
        assert_eq!(expected.unsupported("points"), Some("no points"));
        assert_eq!(expected.unsupported("lines"), None);
        assert_eq!(expected.names().collect::<Vec<_>>(), ["lines", "points"]);
    }

    #[test]
    #[should_panic(expected = "scene | picture | texels | limits | clause")]
    fn an_exception_needs_a_clause() {
        Expected::parse("lines | color 0 | 3 | 1.5\n", "");
    }
}
