//! Documentation in Rust from the registry's comments.
//!
//! A comment names things in backticks, with their C names: `VkGaussianOrderGAURAST`,
//! `VK_GAUSSIAN_ORDER_PER_PIXEL_GAURAST`, `VkGaussianCameraGAURAST::eye`, and members of the structure that it
//! describes. In Rust these are links.

use super::extension::{Extension, Structure, TAG, rust_constant, rust_name};
use crate::rust::snake_case;
use std::fmt::Write;

/// The most characters of text in a line.
const WIDTH: usize = 92;

/// The comments of an extension.
#[derive(Clone, Copy)]
pub(super) struct Comments<'a> {
    pub(super) extension: &'a Extension,
    /// The path from the file to the module of the definitions.
    pub(super) path: &'a str,
}

impl Comments<'_> {
    /// The documentation of a thing with a C name, with the name as its alias.
    pub(super) fn item(&self, name: &str, comment: &str, of: Option<&Structure>) -> String {
        let text = if comment.trim().is_empty() { format!("/// `{name}`.\n") } else { self.text(comment, of) };
        format!("{text}#[doc(alias = \"{name}\")]\n")
    }

    /// A comment as documentation. Empty lines separate its paragraphs.
    pub(super) fn text(&self, comment: &str, of: Option<&Structure>) -> String {
        let mut text = String::new();
        let lines: Vec<&str> = comment.trim().lines().map(str::trim).collect();
        for (index, paragraph) in lines.split(|line| line.is_empty()).enumerate() {
            if index > 0 {
                text.push_str("///\n");
            }
            let mut line = String::new();
            for word in self.links(&paragraph.join(" "), of).split_whitespace() {
                if !line.is_empty() && line.len() + 1 + word.len() > WIDTH {
                    let _ = writeln!(text, "///{line}");
                    line.clear();
                }
                line.push(' ');
                line.push_str(word);
            }
            let _ = writeln!(text, "///{line}");
        }
        text
    }

    /// A paragraph whose names in backticks are replaced by links to the Rust names.
    fn links(&self, paragraph: &str, of: Option<&Structure>) -> String {
        let mut text = String::new();
        for (index, part) in paragraph.split('`').enumerate() {
            if index % 2 == 0 {
                text.push_str(&part.replace('[', "\\[").replace(']', "\\]"));
            } else {
                text.push_str(&self.link(part, of));
            }
        }
        text
    }

    fn link(&self, name: &str, of: Option<&Structure>) -> String {
        let is_member = |member: &str| {
            let members = of.into_iter().flat_map(|structure| &structure.members);
            members.into_iter().any(|known| known.name == member)
        };
        let to = if let Some((ty, member)) = name.split_once("::") {
            format!("{}::{}", rust_name(ty), snake_case(member))
        } else if is_member(name) {
            return format!("`{}`", snake_case(name));
        } else if !name.ends_with(TAG) {
            return format!("`{name}`");
        } else if name.starts_with("Vk") {
            rust_name(name).to_owned()
        } else if let Some(value) = self.value(name) {
            value
        } else if name.starts_with("VK_") && !name.contains("...") {
            rust_constant(name).to_owned()
        } else {
            return format!("`{name}`");
        };
        if self.path.is_empty() { format!("[`{to}`]") } else { format!("[`{to}`]({}{to})", self.path) }
    }

    /// The path of a value of one of the extension's enums.
    fn value(&self, name: &str) -> Option<String> {
        self.extension.enums.iter().find_map(|of| {
            let value = of.values.iter().find(|value| value.name == name)?;
            let ty = of.type_name();
            Some(format!("{}::{}", rust_name(&ty), of.short_name(value)))
        })
    }
}
