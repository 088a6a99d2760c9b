//! Cases that are programs: Vulkan commands that a device executes, and the pictures that they must leave.

use gaurast_oracle::oracle::Stored;
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_testkit::{Commands, Gpu, Graphics};

use crate::draw::Draw;
use crate::features;
use crate::judge::{Expected, expected, stored_before};
use crate::picture::Picture;
use crate::stage::Stage;

/// A picture that a program must leave.
pub(crate) enum Answer {
    /// That of a draw, however the program records it.
    Draw(Box<Draw>),
    /// Another one.
    Picture(Box<dyn Fn(PrecisionClass) -> Expected + Send + Sync>),
}

impl Answer {
    /// The contents that the attachments may have.
    pub(crate) fn expected(&self, precision: PrecisionClass) -> Expected {
        match self {
            Self::Draw(draw) => {
                let draw = Draw::clone(draw).held_to(precision);
                expected(&draw, &stored_before(&draw))
            }
            Self::Picture(expected) => expected(precision),
        }
    }
}

/// What a program leaves: a picture for each of its answers, or a sentence about what is wrong.
pub(crate) type Left = Result<Vec<Picture>, String>;

/// A program.
pub struct Program {
    /// The names of the features that it needs, beside those of its draws.
    needs: Vec<&'static str>,
    answers: Vec<Answer>,
    execute: Box<dyn Fn(&Gpu) -> Left + Send + Sync>,
}

impl Program {
    /// A program that leaves a picture for each of the answers.
    pub(crate) fn of(answers: Vec<Answer>, execute: impl Fn(&Gpu) -> Left + Send + Sync + 'static) -> Self {
        Self { needs: Vec::new(), answers, execute: Box::new(execute) }
    }

    /// A program that checks something else than pictures.
    pub(crate) fn check(check: impl Fn(&Gpu) -> Result<(), String> + Send + Sync + 'static) -> Self {
        Self::of(Vec::new(), move |gpu| check(gpu).map(|()| Vec::new()))
    }

    /// A program that leaves the pictures of draws.
    pub(crate) fn pictures(draws: Vec<Draw>, execute: impl Fn(&Gpu) -> Left + Send + Sync + 'static) -> Self {
        Self::of(draws.into_iter().map(|draw| Answer::Draw(Box::new(draw))).collect(), execute)
    }

    /// A program on a stage that leaves the picture of a draw, however it records it.
    pub(crate) fn on_stage(draw: Draw, execute: impl Fn(&Stage<'_>) + Send + Sync + 'static) -> Self {
        Self::changed(draw, |_| {}, execute)
    }

    /// The same with a change of the stage's pipeline.
    pub(crate) fn changed(
        draw: Draw,
        change: impl Fn(&mut Graphics<'_>) + Send + Sync + 'static,
        execute: impl Fn(&Stage<'_>) + Send + Sync + 'static,
    ) -> Self {
        let own = draw.clone();
        Self::pictures(vec![draw], move |gpu| {
            let stage = Stage::changed(gpu, &own, &change);
            execute(&stage);
            Ok(vec![stage.picture()])
        })
    }

    /// The same in one pass of one command buffer, in which everything of the stage is bound.
    pub(crate) fn pass(draw: Draw, record: impl Fn(&Stage<'_>, &Commands) + Send + Sync + 'static) -> Self {
        Self::on_stage(draw, move |stage| stage.run(|commands| record(stage, commands)))
    }

    /// The same program, which also needs a feature.
    #[must_use]
    pub(crate) fn needing(mut self, feature: &'static str) -> Self {
        self.needs.push(feature);
        self
    }

    /// The names of all features that it needs.
    pub fn needs(&self) -> Vec<&'static str> {
        let of_draws = self.draws().flat_map(features::needs);
        self.needs.iter().copied().chain(of_draws).collect()
    }

    /// The draws whose pictures it leaves.
    pub(crate) fn draws(&self) -> impl Iterator<Item = &Draw> {
        self.answers.iter().filter_map(|answer| match answer {
            Answer::Draw(draw) => Some(&**draw),
            Answer::Picture(_) => None,
        })
    }

    /// The contents that the attachments may have, by picture.
    pub(crate) fn expected(&self, precision: PrecisionClass) -> Vec<Expected> {
        self.answers.iter().map(|answer| answer.expected(precision)).collect()
    }

    /// Executes it.
    pub(crate) fn execute(&self, gpu: &Gpu) -> Left {
        (self.execute)(gpu)
    }
}

/// A picture that has colours alone.
pub(crate) fn colors(color: Vec<[f32; 4]>) -> Picture {
    Picture { color, stored: Stored::default() }
}
