//! Occlusion queries, and statistics of resolve shaders.

use ash::vk;
use gaurast_testkit::{Buffer, Commands, Gpu};

use super::chapter::Chapter;
use super::input::vertices;
use super::scenes::{cloud, dense};
use crate::draw::{Blend, Draw, Shown};
use crate::judge::{expected, stored_before};
use crate::program::Program;
use crate::stage::Stage;

/// A pool of queries.
struct Queries<'a> {
    gpu: &'a Gpu,
    pool: vk::QueryPool,
    count: u32,
}

impl<'a> Queries<'a> {
    fn new(gpu: &'a Gpu, ty: vk::QueryType, count: u32, statistics: vk::QueryPipelineStatisticFlags) -> Self {
        let info = vk::QueryPoolCreateInfo::default().query_type(ty).query_count(count).pipeline_statistics(statistics);
        // SAFETY: the pool is destroyed after the commands have run.
        let pool = unsafe { gpu.device().create_query_pool(&info, None) }.expect("a query pool");
        Self { gpu, pool, count }
    }

    fn reset(&self, commands: &Commands) {
        let (device, raw) = commands.raw();
        // SAFETY: the commands are being recorded, here and below.
        unsafe { device.cmd_reset_query_pool(raw, self.pool, 0, self.count) };
    }

    fn during(&self, commands: &Commands, query: u32, record: impl FnOnce()) {
        let (device, raw) = commands.raw();
        // SAFETY: as above.
        unsafe { device.cmd_begin_query(raw, self.pool, query, vk::QueryControlFlags::PRECISE) };
        record();
        // SAFETY: as above.
        unsafe { device.cmd_end_query(raw, self.pool, query) };
    }

    fn results(&self) -> Vec<u64> {
        let mut results = vec![0_u64; self.count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the queries have run.
        let got = unsafe { self.gpu.device().get_query_pool_results(self.pool, 0, &mut results, flags) };
        got.expect("results");
        results
    }
}

impl Drop for Queries<'_> {
    fn drop(&mut self) {
        // SAFETY: the commands have run.
        unsafe { self.gpu.device().destroy_query_pool(self.pool, None) };
    }
}

fn occlusion(gpu: &Gpu, count: u32) -> Queries<'_> {
    Queries::new(gpu, vk::QueryType::OCCLUSION, count, vk::QueryPipelineStatisticFlags::empty())
}

/// The least and the greatest number of fragments of a draw.
fn fragments(draw: &Draw) -> [u64; 2] {
    let empty = Draw { behind: [0.0; 4], blend: Blend::Replace, depth: None, ..draw.clone() };
    let reference = expected(&empty, &stored_before(&empty)).color;
    let count = |is_there: &dyn Fn(usize) -> bool| (0..reference.nominal.len()).filter(|&at| is_there(at)).count();
    let least = count(&|at| reference.outcomes(at).all(|outcome| outcome[3] > 0.0));
    let most = count(&|at| reference.outcomes(at).any(|outcome| outcome[3] > 0.0));
    [least as u64, most as u64]
}

/// Reports that a number is not one of those that are expected.
fn check(name: &str, number: u64, [least, most]: [u64; 2]) -> Result<(), String> {
    match (least..=most).contains(&number) {
        true => Ok(()),
        false => Err(format!("{name} counts {number}, not {least} to {most}")),
    }
}

fn part(first: u32, count: u32) -> Draw {
    // Some pixels have no fragment.
    Draw { calls: vec![vertices(first, count)], ..Draw::new(cloud(561, 200, 0)) }
}

pub(super) fn queries(chapter: &mut Chapter<'_>) {
    chapter.program("occlusion.one", || {
        let program = Program::check(|gpu| {
            let draw = part(0, 200);
            let (stage, queries) = (Stage::changed(gpu, &draw, &|_| {}), occlusion(gpu, 1));
            gpu.run(|commands| {
                queries.reset(commands);
                stage.pass(commands, || queries.during(commands, 0, || commands.draw(0..200)));
            });
            check("the query", queries.results()[0], fragments(&draw))
        });
        program.needing("occlusionQueryPrecise")
    });
    chapter.program("occlusion.several", || {
        let program = Program::check(|gpu| {
            let draw = part(0, 200);
            let (stage, queries) = (Stage::changed(gpu, &draw, &|_| {}), occlusion(gpu, 3));
            gpu.run(|commands| {
                queries.reset(commands);
                stage.pass(commands, || {
                    commands.draw(0..50);
                    queries.during(commands, 0, || commands.draw(0..80));
                    queries.during(commands, 1, || {});
                    queries.during(commands, 2, || commands.draw(80..200));
                });
            });
            let results = queries.results();
            check("the first query", results[0], fragments(&part(0, 80)))?;
            check("the query of nothing", results[1], [0, 0])?;
            check("the third query", results[2], fragments(&part(80, 120)))
        });
        program.needing("occlusionQueryPrecise")
    });
    // A query that is active where a set ends counts the set; one that is active while its draws are recorded does not.
    chapter.program("occlusion.set", || {
        let program = Program::check(|gpu| {
            let draw = part(0, 200);
            let (stage, queries) = (Stage::changed(gpu, &draw, &|_| {}), occlusion(gpu, 1));
            gpu.run(|commands| {
                queries.reset(commands);
                stage.pass(commands, || {
                    queries.during(commands, 0, || {
                        commands.gaussian_set(|| {
                            commands.draw(0..80);
                            commands.draw(80..200);
                        });
                    });
                });
            });
            check("the query", queries.results()[0], fragments(&draw))
        });
        program.needing("occlusionQueryPrecise").needing("mergedDraws")
    });
    chapter.program("occlusion.copied", || {
        let program = Program::check(|gpu| {
            let draw = part(0, 200);
            let (stage, queries) = (Stage::changed(gpu, &draw, &|_| {}), occlusion(gpu, 1));
            let results = Buffer::new(gpu, 8);
            gpu.run(|commands| {
                queries.reset(commands);
                stage.pass(commands, || queries.during(commands, 0, || commands.draw(0..200)));
                let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
                let (device, raw) = commands.raw();
                // SAFETY: the buffer has a place for the result.
                unsafe { device.cmd_copy_query_pool_results(raw, queries.pool, 0, 1, results.raw, 0, 8, flags) };
                commands.barrier();
            });
            check("the copied query", results.values::<u64>()[0], fragments(&draw))
        });
        program.needing("occlusionQueryPrecise")
    });
    chapter.program("statistics.resolve_shader", || {
        let program = Program::check(|gpu| {
            let draw = Draw {
                shown: Some(Shown::Accumulated),
                blend: Blend::Replace,
                calls: vec![vertices(0, 300)],
                ..Draw::new(dense(562, 0))
            };
            let statistics = vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS;
            let queries = Queries::new(gpu, vk::QueryType::PIPELINE_STATISTICS, 1, statistics);
            let stage = Stage::changed(gpu, &draw, &|_| {});
            gpu.run(|commands| {
                queries.reset(commands);
                stage.pass(commands, || {
                    let (device, raw) = commands.raw();
                    // SAFETY: the commands are being recorded.
                    unsafe {
                        device.cmd_begin_query(raw, queries.pool, 0, vk::QueryControlFlags::empty());
                        commands.draw(0..300);
                        device.cmd_end_query(raw, queries.pool, 0);
                    }
                });
            });
            // Helper invocations may count.
            let [least, most] = fragments(&Draw { shown: None, ..draw.clone() });
            check("the query", queries.results()[0], [least, 4 * most])
        });
        program.needing("pipelineStatisticsQuery").needing("resolveFragmentShader")
    });
}
