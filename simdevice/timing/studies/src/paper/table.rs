//! The tables of a report. A row compares a number of the paper with the model's.

use serde::Serialize;

/// The origin of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Label {
    /// The paper gives it and the model uses it.
    Input,
    /// Another source than the paper gives it and the model uses it.
    Cited,
    /// The model needs it, and no source gives it.
    Assumed,
    /// A constant of the model was chosen to reproduce it.
    Calibrated,
    /// It follows from the paper's numbers by arithmetic.
    Solved,
    /// Numbers of the paper that don't fit together; the arithmetic is in the note.
    Contradiction,
    /// The model computes it from other numbers.
    Predicted,
    /// A regression over the paper's own numbers, in which no machine is simulated.
    Fit,
    /// No machine can pass it, so it predicts nothing.
    Bound,
    /// A number of something similar to the paper's. It shows a possibility and proves nothing.
    Illustration,
    /// A test would need data that is not available.
    Untestable,
}

impl Label {
    /// The label's text in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Cited => "cited",
            Self::Assumed => "assumed",
            Self::Calibrated => "calibrated",
            Self::Solved => "solved",
            Self::Contradiction => "contradiction",
            Self::Predicted => "predicted",
            Self::Fit => "fit",
            Self::Bound => "bound",
            Self::Illustration => "illustration",
            Self::Untestable => "not testable",
        }
    }
}

/// A number of the paper and the model's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The name of the number.
    pub item: String,
    /// The paper's value.
    pub paper: String,
    /// The model's value.
    pub model: String,
    /// The difference, if both are numbers.
    pub difference: String,
    /// The origin of the model's value.
    pub label: Label,
    /// A note on how the value comes about.
    pub note: String,
}

impl Row {
    /// A row without a difference or a note.
    pub fn new(item: impl Into<String>, paper: impl Into<String>, model: impl Into<String>, label: Label) -> Self {
        Self {
            item: item.into(),
            paper: paper.into(),
            model: model.into(),
            difference: String::new(),
            label,
            note: String::new(),
        }
    }

    /// A row of two numbers, with `decimals` decimals.
    pub fn numbers(
        item: impl Into<String>,
        unit: &str,
        [paper, model]: [f64; 2],
        decimals: usize,
        label: Label,
    ) -> Self {
        let text = |value: f64| format!("{value:.decimals$}{unit}");
        let mut row = Self::new(item, text(paper), text(model), label);
        row.difference = format!("{:+.1} %", (model / paper - 1.0) * 100.0);
        row
    }

    /// A row of an input.
    pub fn input(item: impl Into<String>, value: impl Into<String>) -> Self {
        let value = value.into();
        Self::new(item, value.clone(), value, Label::Input)
    }

    /// A row of the model's number that the paper doesn't give.
    pub fn without_paper(
        item: impl Into<String>,
        value: impl Into<String>,
        label: Label,
        source: impl Into<String>,
    ) -> Self {
        Self::new(item, "", value, label).note(source)
    }

    /// The row with a note on how its number comes about.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }
}

/// A table of the report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Section {
    /// Its heading.
    pub title: &'static str,
    /// Its introduction.
    pub text: String,
    /// Its rows.
    pub rows: Vec<Row>,
}
