use crate::blocks::BlockIndex;
use crate::change::Comparison;
use crate::collected::Collected;
use crate::compare::{BlockResult, Comparer};
use crate::options::CompareOptions;
use crate::voxel_class::VoxelClass;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use voxtile::mapper::MapView;
use voxtile::{Error, Result};

/// Result of a span of the blocks of a comparison, for [`join_spans`]. Its size depends on the changes, not on the maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparedSpan {
    blocks: Vec<(BlockIndex, BlockResult)>,
}

/// Returns the number of blocks of a comparison, which [`compare_span`] divides.
///
/// # Errors
///
/// Fails if the resolutions differ or an option is invalid.
pub fn count_blocks<A: MapView, B: MapView>(before: &A, after: &B, options: &CompareOptions) -> Result<u64> {
    Ok(Comparer::new(before, after, options)?.blocks().len() as u64)
}

/// Compares a span of the blocks of two maps, by their numbers from 0 on, so that several processes share the work of
/// [`compare`](crate::compare()). `progress` receives the number of blocks of the span done and in total.
///
/// # Errors
///
/// As for [`compare`](crate::compare()).
pub fn compare_span<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &CompareOptions,
    span: Range<u64>,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<ComparedSpan> {
    let comparer = Comparer::new(before, after, options)?.with_span(span);
    let mut blocks = Vec::new();
    comparer.for_each_block(
        &VoxelClass::ALL,
        progress,
        |block, classes| comparer.block_result(block, classes),
        |block, result| {
            blocks.push((block, result));
            Ok(())
        },
    )?;
    Ok(ComparedSpan { blocks })
}

/// Joins the results of the spans of a comparison, in their order. The result is that of [`compare`](crate::compare())
/// with the same maps and options; the changes may cross the borders of spans.
///
/// # Errors
///
/// Fails if the spans are not all blocks of the two maps, or as for [`count_blocks`].
pub fn join_spans<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &CompareOptions,
    spans: impl IntoIterator<Item = ComparedSpan>,
) -> Result<Comparison> {
    let comparer = Comparer::new(before, after, options)?;
    let mut collected = Collected::new(&comparer);
    let mut blocks = comparer.blocks().into_iter();
    for (block, result) in spans.into_iter().flat_map(|span| span.blocks) {
        if blocks.next() != Some(block) {
            return Err(are_of_others());
        }
        collected.take(block, result);
    }
    match blocks.next() {
        None => Ok(collected.finish()),
        Some(_) => Err(are_of_others()),
    }
}

fn are_of_others() -> Error {
    let reason =
        "they are not all blocks of the two maps in order: compare each span of both maps, as they are now";
    Error::argument("spans", reason)
}
