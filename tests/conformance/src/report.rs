//! The results as JUnit XML.

use std::fmt::Write;
use std::time::Duration;

use crate::run::Outcome;

/// A case that was run.
#[derive(Clone, Debug)]
pub struct Result {
    /// The chapter.
    pub chapter: &'static str,
    /// The name within the chapter.
    pub name: String,
    /// The outcome.
    pub outcome: Outcome,
    /// The time of the case, with the oracle's work included.
    pub time: Duration,
}

/// Numbers of cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of cases that passed.
    pub passed: usize,
    /// Number of cases that failed.
    pub failed: usize,
    /// Number of cases that the device does not support.
    pub not_supported: usize,
}

impl Counts {
    /// Counts the results.
    pub fn of<'a>(results: impl IntoIterator<Item = &'a Result>) -> Self {
        let mut counts = Self::default();
        for result in results {
            *match result.outcome {
                Outcome::Pass(_) => &mut counts.passed,
                Outcome::Fail(_) => &mut counts.failed,
                Outcome::NotSupported(_) => &mut counts.not_supported,
            } += 1;
        }
        counts
    }

    /// The number of all cases.
    pub fn all(&self) -> usize {
        self.passed + self.failed + self.not_supported
    }
}

/// The results as JUnit XML, with a test suite for each chapter.
pub fn junit(device: &str, results: &[Result]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let total = Counts::of(results);
    let _ = writeln!(
        xml,
        "<testsuites name=\"{}\" tests=\"{}\" failures=\"{}\">",
        escaped(device),
        total.all(),
        total.failed
    );
    for suite in results.chunk_by(|a, b| a.chapter == b.chapter) {
        let (chapter, counts) = (suite[0].chapter, Counts::of(suite));
        let _ = writeln!(
            xml,
            "  <testsuite name=\"{chapter}\" tests=\"{}\" failures=\"{}\" skipped=\"{}\">",
            counts.all(),
            counts.failed,
            counts.not_supported
        );
        for result in suite {
            let _ = write!(
                xml,
                "    <testcase classname=\"{chapter}\" name=\"{}\" time=\"{:.3}\"",
                escaped(&result.name),
                result.time.as_secs_f64()
            );
            let _ = match &result.outcome {
                Outcome::Pass(_) => writeln!(xml, "/>"),
                Outcome::Fail(failure) => {
                    let message = escaped(&failure.message);
                    writeln!(xml, "><failure message=\"{message}\"/></testcase>")
                }
                Outcome::NotSupported(what) => {
                    writeln!(xml, "><skipped message=\"{}\"/></testcase>", escaped(what))
                }
            };
        }
        xml.push_str("  </testsuite>\n");
    }
    xml.push_str("</testsuites>\n");
    xml
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_suite_for_each_chapter() {
        let result = |chapter, name: &str, outcome| Result {
            chapter,
            name: name.to_owned(),
            outcome,
            time: Duration::from_millis(1500),
        };
        let failure = crate::run::Failure { message: "2 < 3 & \"so\"".to_owned(), picture: None };
        let results = [
            result("order", "a", Outcome::Pass(1e-7)),
            result("order", "b", Outcome::NotSupported("perPixelOrder")),
            result("state", "c", Outcome::Fail(failure)),
        ];
        let xml = junit("a device", &results);
        assert!(xml.contains("<testsuites name=\"a device\" tests=\"3\" failures=\"1\">"));
        assert!(xml.contains("<testsuite name=\"order\" tests=\"2\" failures=\"0\" skipped=\"1\">"));
        assert!(xml.contains("name=\"a\" time=\"1.500\"/>"));
        assert!(xml.contains("<failure message=\"2 &lt; 3 &amp; &quot;so&quot;\"/>"));
    }
}
