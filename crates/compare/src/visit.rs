use crate::change::Comparison;
use crate::compare::Comparer;
use crate::components::Components;
use crate::options::CompareOptions;
use crate::voxel_class::VoxelClass;
use voxtile::mapper::MapView;
use voxtile::{Result, VoxelIndex};

/// Voxel that is occupied in one of two maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComparedVoxel {
    /// Index along x, y and z.
    pub index: VoxelIndex,
    /// Class; an unchanged voxel is one of the later map.
    pub class: VoxelClass,
    /// Number of its change; `None` if it is in no listed change.
    pub change: Option<u32>,
}

/// Visits the occupied voxels of two maps, with the changes that [`compare`](crate::compare()) found with the same
/// options: blocks by x, then y, then z, classes in the order of [`VoxelClass::ALL`] within each, voxels by z, then y,
/// then x within each. Only voxels of the given classes are visited.
///
/// # Errors
///
/// As for [`compare`](crate::compare()), and errors of `visit`.
pub fn for_each_voxel<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &CompareOptions,
    comparison: &Comparison,
    classes: &[VoxelClass],
    mut visit: impl FnMut(ComparedVoxel) -> Result<()>,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<()> {
    Comparer::new(before, after, options)?.for_each_block(
        classes,
        progress,
        |_, bits| {
            let wanted = VoxelClass::ALL.into_iter().filter(|class| classes.contains(class));
            Ok(wanted.map(|class| (class, Components::of(bits.of_class(class)))).collect::<Vec<_>>())
        },
        |_, of_block| {
            for (class, components) in of_block {
                let is_change = matches!(class, VoxelClass::Appeared | VoxelClass::Vanished);
                for (index, part) in components.voxels() {
                    let lowest = components.parts[part as usize].lowest;
                    let change = comparison.change_of_part.get(&lowest).filter(|_| is_change).copied();
                    visit(ComparedVoxel { index, class, change })?;
                }
            }
            Ok(())
        },
    )
}
