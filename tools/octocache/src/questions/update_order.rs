//! Figure 10: the same updates of the octree in different orders.

use crate::dataset::{Dataset, map_config};
use crate::setting::Setting;
use crate::update_stream::{Update, accumulated, updates};
use anyhow::Result;
use report::Answer;
use report::Samples;
use report::Stopwatch;
use report::plot::{Bars, Content, Panel, Plot};
use report::{Cell, Table};
use rustc_hash::FxHashSet;
use std::hint::black_box;
use voxtile::octree::Octree;
use voxtile::sensor::SensorModel;
use voxtile::space::{MortonCode, VoxelKey};
use voxtile_simulation::Random;

const RESOLUTION_M: f64 = 0.1;

/// An order of updates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Original,
    Random,
    Xyz,
    Yzx,
    Zxy,
    Morton,
    /// Morton order, in one call.
    MortonAtOnce,
}

const ORDERS: [(Order, &str); 7] = [
    (Order::Original, "ray by ray"),
    (Order::Random, "random"),
    (Order::Xyz, "by x, y, z"),
    (Order::Yzx, "by y, z, x"),
    (Order::Zxy, "by z, x, y"),
    (Order::Morton, "Morton"),
    (Order::MortonAtOnce, "Morton, one call"),
];

/// The updates in one order, and their measurements.
struct Contender {
    order: Order,
    updates: Vec<(MortonCode, f32)>,
    ns_per_update: Samples,
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let columns = || ["set", "updates"].into_iter().chain(ORDERS.map(|(_, name)| name));
    let caption = "CPU nanoseconds an update in `Octree::set`, by order, into an empty tree of voxels of 0.1 m, median of \
                   the runs. *all*: every update of every ray; *distinct*: each voxel once, with its last value.";
    let mut times = Table::new("update_order", caption, columns().chain(["largest spread"]));
    let caption =
        "Steps in the tree from a voxel to the next, up and down, on average: the paper's F by the updates.";
    let mut steps = Table::new("update_order_steps", caption, columns());
    let mut panels = Vec::new();
    for (kind, is_distinct) in [("all", false), ("distinct", true)] {
        let mut sets = Vec::new();
        for dataset in &setting.datasets {
            let contenders = measure(setting, dataset, is_distinct)?;
            let set = format!("{}, {kind}", dataset.name);
            let spread =
                contenders.iter().map(|contender| contender.ns_per_update.spread()).fold(f64::NAN, f64::max);
            let ns = |contender: &Contender| contender.ns_per_update.median();
            times.push(row(&set, &contenders, ns, 0).chain([Cell::Share(spread)]));
            steps.push(row(&set, &contenders, |contender| mean_distance(&contender.updates), 2));
            sets.push((dataset.name, contenders));
        }
        panels.push(panel(kind, &sets));
    }
    let caption = "Time of an update of the octree by the order of the updates".to_owned();
    Ok(Answer { tables: vec![times, steps], plots: vec![Plot { file: "update_order", caption, panels }] })
}

/// A row with one value per order; orders without a measurement have none.
fn row(
    set: &str,
    contenders: &[Contender],
    value: impl Fn(&Contender) -> f64,
    digits: usize,
) -> impl Iterator<Item = Cell> {
    let updates = contenders.first().map_or(0, |contender| contender.updates.len() as u64);
    let values =
        ORDERS.map(|(order, _)| Cell::Number(of_order(contenders, order).map_or(f64::NAN, &value), digits));
    [set.into(), updates.into()].into_iter().chain(values)
}

fn of_order(contenders: &[Contender], order: Order) -> Option<&Contender> {
    contenders.iter().find(|contender| contender.order == order)
}

fn panel(kind: &str, sets: &[(&str, Vec<Contender>)]) -> Panel {
    let series = ORDERS.map(|(order, name)| {
        let of_sets = sets.iter().filter_map(|(_, contenders)| of_order(contenders, order));
        (name.to_owned(), of_sets.map(|contender| contender.ns_per_update.median()).collect::<Vec<_>>())
    });
    let bars = Bars {
        categories: sets.iter().map(|(set, _)| (*set).to_owned()).collect(),
        series: series.into_iter().filter(|(_, values)| !values.is_empty()).collect(),
        are_stacked: false,
    };
    Panel {
        title: format!("{kind} updates"),
        x_label: String::new(),
        y_label: "ns an update".to_owned(),
        content: Content::Bars(bars),
    }
}

/// Runs all orders in turn.
fn measure(setting: &Setting, dataset: &Dataset, is_distinct: bool) -> Result<Vec<Contender>> {
    let config = map_config(RESOLUTION_M)?;
    let scans = dataset.scans(setting.size(40, 2))?;
    let stream = updates(&config.grid, &scans, setting.size(2_000_000, 50_000));
    let mut contenders = contenders(&config.sensor_model, &stream, is_distinct);
    for _ in 0..setting.runs {
        contenders.iter_mut().try_for_each(Contender::run)?;
    }
    Ok(contenders)
}

/// Returns the same updates in all orders. If every update counts, its value is the log-odds of the voxel after it.
fn contenders(model: &SensorModel, stream: &[Update], is_distinct: bool) -> Vec<Contender> {
    let distinct = if is_distinct { last_values(&accumulated(model, stream)) } else { Vec::new() };
    let mut contenders = Vec::new();
    for (order, _) in ORDERS {
        let updates = if is_distinct {
            ordered(order, &distinct, |(code, _)| *code)
        } else if order == Order::MortonAtOnce {
            // A call accepts each voxel only once.
            continue;
        } else {
            let stream = ordered(order, stream, |update| VoxelKey::from_index(update.voxel).morton());
            accumulated(model, &stream)
        };
        contenders.push(Contender { order, updates, ns_per_update: Samples::default() });
    }
    contenders
}

/// Each voxel once, at its first position, with its last value.
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

/// Fisher-Yates shuffle.
fn shuffle<T>(items: &mut [T]) {
    let mut random = Random::of(1, &[items.len() as i64]);
    for last in (1..items.len()).rev() {
        items.swap(last, random.below(last as u64 + 1) as usize);
    }
}

impl Contender {
    /// Runs once, with a new tree.
    fn run(&mut self) -> Result<()> {
        let mut octree = Octree::new();
        let stopwatch = Stopwatch::start()?;
        if self.order == Order::MortonAtOnce {
            octree.write_sorted(&self.updates);
        } else {
            self.updates.iter().for_each(|&(code, value)| octree.set(code, value));
        }
        let took = stopwatch.stop()?;
        black_box(&octree);
        self.ns_per_update.push(took.own_s * 1e9 / self.updates.len().max(1) as f64);
        Ok(())
    }
}

/// The paper's F divided by the number of updates: steps in the tree from a voxel to the next, up and down.
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
    fn all_orders_have_the_same_updates_and_distinct_ones_give_the_same_tree() {
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
            assert_eq!(contender.updates.len(), stream.len(), "{:?}", contender.order);
        }
    }

    #[test]
    fn morton_order_has_the_shortest_distances() {
        let config = map_config(0.4).unwrap();
        let stream = updates(&config.grid, &datasets(Path::new(""))[0].scans(1).unwrap(), 20_000);
        let contenders = contenders(&config.sensor_model, &stream, true);
        let distance = |order| of_order(&contenders, order).map(|found| mean_distance(&found.updates));
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
