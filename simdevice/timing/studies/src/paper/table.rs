//! A report's tables: rows of a number of the paper's and the model's.

use serde::Serialize;

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Label {
    /// The paper says it and the model uses it.
    Input,
    /// Another source than the paper says it and the model uses it.
    Cited,
    /// Nobody says it; the model needs it.
    Assumed,
    /// A constant of the model was chosen so that it comes out.
    Calibrated,
    /// It follows from the paper's numbers by arithmetic.
    Solved,
    /// The model says it without having been told.
    Predicted,
    /// Of something else that resembles the paper's: it shows what could be, and is evidence of nothing.
    Illustration,
    /// It would need what is not at hand.
    Untestable,
}

impl Label {
    /// As in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Cited => "cited",
            Self::Assumed => "assumed",
            Self::Calibrated => "calibrated",
            Self::Solved => "solved",
            Self::Predicted => "predicted",
            Self::Illustration => "illustration",
            Self::Untestable => "not testable",
        }
    }
}

/// A number of the paper and the model's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What it is.
    pub item: String,
    /// What the paper says.
    pub paper: String,
    /// What the model says.
    pub model: String,
    /// The difference, where both are numbers.
    pub difference: String,
    /// Where the model's number comes from.
    pub label: Label,
    /// How.
    pub note: String,
}

impl Row {
    /// A row without a difference or a note.
    pub fn new(
        item: impl Into<String>,
        paper: impl Into<String>,
        model: impl Into<String>,
        label: Label,
    ) -> Self {
        Self {
            item: item.into(),
            paper: paper.into(),
            model: model.into(),
            difference: String::new(),
            label,
            note: String::new(),
        }
    }

    /// A row of two numbers, with as many decimals as are given.
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

    /// A number that goes in as it is.
    pub fn input(item: impl Into<String>, value: impl Into<String>) -> Self {
        let value = value.into();
        Self::new(item, value.clone(), value, Label::Input)
    }

    /// A number of the model's that the paper doesn't say.
    pub fn without_paper(
        item: impl Into<String>,
        value: impl Into<String>,
        label: Label,
        source: impl Into<String>,
    ) -> Self {
        Self::new(item, "", value, label).note(source)
    }

    /// The row, with how its number comes about.
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
    /// What it shows.
    pub text: String,
    /// Its rows.
    pub rows: Vec<Row>,
}
