//! Figure 10: the same updates to the octree in other orders.

use crate::answer::{Answer, Setting};
use crate::dataset::map_config;
use crate::plot::{Bars, Content, Panel, Plot};
use crate::samples::Samples;
use crate::stopwatch::Stopwatch;
use crate::table::{Cell, Table};
use crate::update_stream::{Update, accumulated, updates};
use anyhow::Result;
use rustc_hash::FxHashSet;
use std::hint::black_box;
use voxtile::octree::Octree;
use voxtile::sensor::SensorModel;
use voxtile::simulation::Random;
use voxtile::space::{MortonCode, VoxelKey};

const RESOLUTION_M: f64 = 0.1;

/// An order in which the same updates come.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Order {
    Original,
    Random,
    Xyz,
    Yzx,
    Zxy,
    Morton,
    /// In Morton order and in one call.
    MortonAtOnce,
}

const ORDERS: [(Order, &str); 7] = [
    (Order::Original, "as rays come"),
    (Order::Random, "random"),
    (Order::Xyz, "by x, y, z"),
    (Order::Yzx, "by y, z, x"),
    (Order::Zxy, "by z, x, y"),
    (Order::Morton, "Morton"),
    (Order::MortonAtOnce, "Morton, one call"),
];

/// An order's updates, and what was measured with it.
struct Contender {
    order: Order,
    name: &'static str,
    updates: Vec<(MortonCode, f32)>,
    ns_per_update: Samples,
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let most = setting.size(2_000_000, 50_000);
    let columns = [
        "set",
        "updates",
        "order",
        "ns an update",
        "spread",
        "times Morton",
        "steps between neighbors (F / N)",
    ];
    let mut table = Table::new(
        "update_order",
        "CPU time of `Octree::set` an update, into an empty tree of 0.1 m, median of the runs; *spread* is largest less \
         smallest by median. *all*: every update of every ray; *distinct*: each voxel once, with its last value.",
        &columns,
    );
    let mut panels = Vec::new();
    for (what, is_distinct) in [("all updates of the rays", false), ("distinct voxels", true)] {
        let mut categories = Vec::new();
        let mut series: Vec<(String, Vec<f64>)> =
            ORDERS.iter().map(|(_, name)| ((*name).to_owned(), Vec::new())).collect();
        for dataset in &setting.datasets {
            let config = map_config(RESOLUTION_M)?;
            let stream = updates(&config.grid, &dataset.scans(setting.size(40, 2))?, most);
            let mut contenders = contenders(&config.sensor_model, &stream, is_distinct);
            measure(&mut contenders, setting.runs)?;
            let morton = median_of(&contenders, Order::Morton);
            let kind = if is_distinct { "distinct" } else { "all" };
            for contender in &contenders {
                let ns = contender.ns_per_update.median();
                table.push([
                    format!("{}, {kind}", dataset.name).as_str().into(),
                    (contender.updates.len() as u64).into(),
                    contender.name.into(),
                    Cell::Number(ns, 0),
                    Cell::Share(contender.ns_per_update.spread()),
                    Cell::Number(ns / morton, 2),
                    Cell::Number(mean_distance(&contender.updates), 2),
                ]);
            }
            for ((order, _), (_, values)) in ORDERS.iter().zip(&mut series) {
                values.push(median_of(&contenders, *order));
            }
            categories.push(dataset.name.to_owned());
        }
        series.retain(|(_, values)| values.iter().any(|value| value.is_finite()));
        panels.push(Panel {
            title: what.to_owned(),
            x_label: String::new(),
            y_label: "ns an update".to_owned(),
            content: Content::Bars(Bars { categories, series, are_stacked: false }),
        });
    }
    let caption = "Time of an update of the octree by the order of the updates".to_owned();
    Ok(Answer { tables: vec![table], plots: vec![Plot { file: "update_order", caption, panels }] })
}

/// The same updates in all orders. Where every update counts, its value is the one that its voxel has by then.
fn contenders(model: &SensorModel, stream: &[Update], is_distinct: bool) -> Vec<Contender> {
    let distinct = if is_distinct { last_values(&accumulated(model, stream)) } else { Vec::new() };
    let mut contenders = Vec::new();
    for (order, name) in ORDERS {
        let updates = if is_distinct {
            ordered(order, &distinct, |(code, _)| *code)
        } else if order == Order::MortonAtOnce {
            // A call takes every voxel once.
            continue;
        } else {
            let stream = ordered(order, stream, |update| VoxelKey::from_index(update.voxel).morton());
            accumulated(model, &stream)
        };
        contenders.push(Contender { order, name, updates, ns_per_update: Samples::default() });
    }
    contenders
}

/// Each voxel once, where it came first, with the value that came last.
fn last_values(updates: &[(MortonCode, f32)]) -> Vec<(MortonCode, f32)> {
    let last: rustc_hash::FxHashMap<MortonCode, f32> = updates.iter().copied().collect();
    let mut seen = FxHashSet::default();
    updates.iter().filter(|(code, _)| seen.insert(*code)).map(|(code, _)| (*code, last[code])).collect()
}

fn ordered<T: Copy>(order: Order, items: &[T], code_of: impl Fn(&T) -> MortonCode) -> Vec<T> {
    let mut items = items.to_vec();
    let axes = match order {
        Order::Original => return items,
        Order::Random => {
            shuffle(&mut items);
            return items;
        }
        Order::Morton | Order::MortonAtOnce => {
            items.sort_by_key(code_of);
            return items;
        }
        Order::Xyz => [0, 1, 2],
        Order::Yzx => [1, 2, 0],
        Order::Zxy => [2, 0, 1],
    };
    items.sort_by_key(|item| {
        let VoxelKey(key) = code_of(item).to_key();
        axes.map(|axis| key[axis])
    });
    items
}

/// Fisher and Yates.
fn shuffle<T>(items: &mut [T]) {
    let mut random = Random::of(1, &[items.len() as i64]);
    for last in (1..items.len()).rev() {
        items.swap(last, random.below(last as u64 + 1) as usize);
    }
}

/// Runs the contenders in turn.
fn measure(contenders: &mut [Contender], runs: usize) -> Result<()> {
    for _ in 0..runs {
        for contender in contenders.iter_mut() {
            let mut octree = Octree::new();
            let stopwatch = Stopwatch::start()?;
            if contender.order == Order::MortonAtOnce {
                octree.write_sorted(&contender.updates);
            } else {
                contender.updates.iter().for_each(|&(code, value)| octree.set(code, value));
            }
            let took = stopwatch.stop()?;
            black_box(&octree);
            contender.ns_per_update.push(took.own_s * 1e9 / contender.updates.len().max(1) as f64);
        }
    }
    Ok(())
}

fn median_of(contenders: &[Contender], order: Order) -> f64 {
    let found = contenders.iter().find(|contender| contender.order == order);
    found.map_or(f64::NAN, |contender| contender.ns_per_update.median())
}

/// The paper's F by the number of updates: steps in the tree from a voxel to the next, up and down.
fn mean_distance(updates: &[(MortonCode, f32)]) -> f64 {
    let steps = |(a, b): (MortonCode, MortonCode)| match (a.0 ^ b.0).checked_ilog2() {
        None => 0,
        Some(highest_bit) => 2 * (u64::from(highest_bit) / 3 + 1),
    };
    let sum: u64 = updates.windows(2).map(|pair| steps((pair[0].0, pair[1].0))).sum();
    sum as f64 / updates.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::datasets;
    use std::path::Path;

    #[test]
    fn all_orders_hold_the_same_updates_and_distinct_ones_make_the_same_tree() {
        let config = map_config(0.4).unwrap();
        let scans = datasets(Path::new(""))[1].scans(1).unwrap();
        let stream = updates(&config.grid, &scans, 20_000);
        let trees = contenders(&config.sensor_model, &stream, true).into_iter().map(|contender| {
            let mut tree = Octree::new();
            contender.updates.iter().for_each(|&(code, value)| tree.set(code, value));
            tree.leaves().map(|leaf| (leaf.code, leaf.depth, leaf.value.to_bits())).collect::<Vec<_>>()
        });
        let trees: Vec<_> = trees.collect();
        assert!(trees.windows(2).all(|pair| pair[0] == pair[1]) && trees.len() == ORDERS.len());
        for contender in contenders(&config.sensor_model, &stream, false) {
            assert_eq!(contender.updates.len(), stream.len(), "{}", contender.name);
        }
    }

    #[test]
    fn no_order_has_shorter_ways_than_mortons() {
        let config = map_config(0.4).unwrap();
        let stream = updates(&config.grid, &datasets(Path::new(""))[0].scans(1).unwrap(), 20_000);
        let contenders = contenders(&config.sensor_model, &stream, true);
        let distance = |order| {
            contenders
                .iter()
                .find(|contender| contender.order == order)
                .map(|found| mean_distance(&found.updates))
        };
        for (order, name) in ORDERS {
            assert!(distance(Order::Morton) <= distance(order), "{name}");
        }
    }

    #[test]
    fn a_step_to_a_sibling_is_two() {
        let updates = [0, 1, 8, 8].map(|code| (MortonCode(code), 0.0));
        assert_eq!(mean_distance(&updates), (2 + 4) as f64 / 4.0);
    }
}
