//! The comparison, in Markdown.
