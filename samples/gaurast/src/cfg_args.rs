//! `cfg_args`: the arguments of a training of 3DGS, as Python prints a `Namespace`.

use std::collections::BTreeMap;

/// The arguments by their names. Texts are without their quotes.
#[derive(Debug, Default)]
pub struct CfgArgs(BTreeMap<String, String>);

impl CfgArgs {
    /// Parses `Namespace(name=value, ...)`. What is none has no arguments.
    pub fn parse(text: &str) -> Self {
        let inner = text.trim().strip_prefix("Namespace(").and_then(|text| text.strip_suffix(')'));
        let mut arguments = BTreeMap::new();
        let mut rest = inner.unwrap_or_default();
        while let Some((name, after)) = rest.split_once('=') {
            let (value, after) = value(after);
            arguments.insert(name.trim().to_owned(), value);
            rest = after.trim_start().strip_prefix(',').unwrap_or_default();
        }
        Self(arguments)
    }

    /// A text.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str).filter(|text| !text.is_empty())
    }

    /// A number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.text(name)?.parse().ok()
    }

    /// A truth value, if it is there.
    pub fn flag(&self, name: &str) -> Option<bool> {
        Some(self.text(name)? == "True")
    }
}

/// The value at the start of `text`, and what follows it.
fn value(text: &str) -> (String, &str) {
    let text = text.trim_start();
    let Some(quote) = text.chars().next().filter(|c| ['\'', '"'].contains(c)) else {
        // Commas of a list do not end it.
        let mut depth = 0_i32;
        let ends = |c: char| {
            depth += i32::from("[(".contains(c)) - i32::from("])".contains(c));
            c == ',' && depth == 0
        };
        let end = text.find(ends).unwrap_or(text.len());
        return (text[..end].trim().to_owned(), &text[end..]);
    };
    let mut value = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => value.extend(characters.next().map(|(_, escaped)| escaped)),
            c if c == quote => return (value, &text[at + 1..]),
            c => value.push(c),
        }
    }
    (value, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_those_of_a_namespace() {
        let text = "Namespace(sh_degree=3, source_path='/data/it\\'s, here', images=\"images_4\", resolution=-1, \
                    depths='', white_background=False, test_iterations=[7000, 30000], eval=True)\n";
        let arguments = CfgArgs::parse(text);
        assert_eq!(arguments.text("source_path"), Some("/data/it's, here"));
        assert_eq!(arguments.text("images"), Some("images_4"));
        assert_eq!(arguments.number("resolution"), Some(-1.0));
        assert_eq!(arguments.text("depths"), None);
        assert_eq!(arguments.text("test_iterations"), Some("[7000, 30000]"));
        assert_eq!(
            ["white_background", "eval", "other"].map(|name| arguments.flag(name)),
            [Some(false), Some(true), None]
        );
        for none in ["", "Namespace(", "Namespace(a", "[]", "Namespace(a='b"] {
            assert_eq!(CfgArgs::parse(none).text("b"), None, "{none}");
        }
    }
}
