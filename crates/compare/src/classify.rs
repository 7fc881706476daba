use crate::bits::Bits;
use crate::block_bits::BlockBits;
use crate::change::EpochCounts;
use crate::voxel_class::VoxelClass;

/// Number of voxels around a voxel on which its class depends.
pub(crate) fn reach(tolerance_voxels: u32) -> u32 {
    tolerance_voxels.max(1)
}

/// What the earlier and what the later map has not seen: the class of voxels that are not known to be hidden, and that
/// of hidden ones.
pub(crate) const NOT_SEEN: [[VoxelClass; 2]; 2] = [
    [VoxelClass::NotSeenBefore, VoxelClass::HiddenBefore],
    [VoxelClass::NotSeenAfter, VoxelClass::HiddenAfter],
];

/// The occupied voxels of both maps in a block, by class.
pub(crate) struct ClassBits {
    /// By the order of [`VoxelClass::ALL`]. Unchanged voxels are those of the later map.
    pub(crate) classes: [Bits; 9],
    /// Unchanged voxels of the earlier map.
    pub(crate) unchanged_before: Bits,
}

impl ClassBits {
    /// Classifies the occupied voxels that are `inside`; none is known to be hidden. Around these, the bits must reach
    /// as far as [`reach`].
    pub(crate) fn of(before: &BlockBits, after: &BlockBits, inside: &Bits, tolerance_voxels: u32) -> Self {
        let near_before = before.occupied.grown(tolerance_voxels);
        let near_after = after.occupied.grown(tolerance_voxels);
        let unchanged = |own: &BlockBits, near_other: &Bits| {
            Bits::combined([&own.occupied, near_other, inside], |[own, near, inside]| own & near & inside)
        };
        let rest = |own: &BlockBits, near_other: &Bits| {
            Bits::combined([&own.occupied, near_other, inside], |[own, near, inside]| own & !near & inside)
        };
        let (rest_before, rest_after) = (rest(before, &near_after), rest(after, &near_before));
        let (free_before, free_after) = (before.clearly_free(), after.clearly_free());
        let changed = |rest: &Bits, own: &BlockBits, free: &Bits| {
            Bits::combined([rest, &own.surely_occupied, free], |[rest, own, free]| rest & own & free)
        };
        let not_seen = |rest: &Bits, other: &BlockBits| {
            Bits::combined([rest, &other.known], |[rest, known]| rest & !known)
        };
        let uncertain = |rest: &Bits, own: &BlockBits, other: &BlockBits, free: &Bits| {
            let bits = [rest, &own.surely_occupied, free, &other.known];
            Bits::combined(bits, |[rest, own, free, known]| rest & known & !(own & free))
        };
        Self {
            unchanged_before: unchanged(before, &near_after),
            classes: [
                unchanged(after, &near_before),
                changed(&rest_after, after, &free_before),
                changed(&rest_before, before, &free_after),
                not_seen(&rest_after, before),
                not_seen(&rest_before, after),
                uncertain(&rest_after, after, before, &free_before),
                uncertain(&rest_before, before, after, &free_after),
                Bits::new(inside.cube()),
                Bits::new(inside.cube()),
            ],
        }
    }

    pub(crate) fn of_class(&self, class: VoxelClass) -> &Bits {
        &self.classes[class as usize]
    }

    /// Moves voxels of one of [`NOT_SEEN`] to the class of hidden voxels.
    pub(crate) fn hide(&mut self, [not_seen, to]: [VoxelClass; 2], hidden: Bits) {
        let [rest, hidden_of_class] = [not_seen, to].map(|class| class as usize);
        self.classes[rest] =
            Bits::combined([&self.classes[rest], &hidden], |[not_seen, hidden]| not_seen & !hidden);
        self.classes[hidden_of_class] = hidden;
    }

    /// Counts the voxels of both maps. `is_hidden_known` is for the earlier and the later one as the map that hides.
    pub(crate) fn counts(&self, is_hidden_known: [bool; 2]) -> [EpochCounts; 2] {
        let count = |class| self.of_class(class).count();
        let of = |unchanged, changed, [not_seen, hidden]: [VoxelClass; 2], uncertain, is_known: bool| {
            let (changed, uncertain, hidden) = (count(changed), count(uncertain), count(hidden));
            let not_seen = count(not_seen) + hidden;
            EpochCounts {
                occupied: unchanged + changed + not_seen + uncertain,
                unchanged,
                changed,
                not_seen,
                hidden: is_known.then_some(hidden),
                uncertain,
            }
        };
        let [in_earlier, in_later] = NOT_SEEN;
        [
            of(
                self.unchanged_before.count(),
                VoxelClass::Vanished,
                in_later,
                VoxelClass::UncertainVanished,
                is_hidden_known[1],
            ),
            of(
                count(VoxelClass::Unchanged),
                VoxelClass::Appeared,
                in_earlier,
                VoxelClass::UncertainAppeared,
                is_hidden_known[0],
            ),
        ]
    }
}
