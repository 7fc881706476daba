use crate::bits::Bits;
use crate::block_bits::BlockBits;
use crate::blocks::{BlockIndex, Cube, blocks_of, tiles_in};
use crate::frontiers::FrontierOptions;
use crate::mask_reader::MaskReader;
use crate::sweep::Sweep;
use crate::tile_masks::Thresholds;
use rustc_hash::FxHashSet;
use voxtile::mapper::MapView;
use voxtile::space::VoxelBox;
use voxtile::{Result, TileIndex};

/// The frontier voxels of a map, block by block.
pub(crate) struct FrontierSearch<'a, V> {
    map: &'a V,
    options: &'a FrontierOptions,
    /// Voxels of the region.
    region: Option<VoxelBox>,
    reader: MaskReader<'a, V>,
}

/// The frontier voxels of a block.
pub(crate) struct FrontierBits {
    /// Number of free voxels.
    pub(crate) free: u64,
    /// Number of occupied voxels.
    pub(crate) occupied: u64,
    /// For each direction, the free voxels whose neighbor is unknown.
    pub(crate) faces: [Bits; 6],
    /// The union of `faces`.
    pub(crate) frontier: Bits,
}

impl<'a, V: MapView> FrontierSearch<'a, V> {
    pub(crate) fn new(map: &'a V, options: &'a FrontierOptions) -> Self {
        Self {
            map,
            options,
            region: options.region.map(|region| map.config().grid.voxels_in(&region)),
            reader: MaskReader::new(map, Thresholds::of(map, f64::INFINITY), options.memory_bytes / 2),
        }
    }

    pub(crate) fn region(&self) -> Option<VoxelBox> {
        self.region
    }

    /// The blocks with observed voxels of the region, in order.
    pub(crate) fn blocks(&self) -> Vec<BlockIndex> {
        let grid = &self.map.config().grid;
        let Some(region) = &self.region else { return blocks_of(grid, self.map.tile_indices().into_iter()) };
        let mut blocks = blocks_of(grid, tiles_in(self.map, region).into_iter());
        blocks.retain(|&block| {
            let [min, end] = Cube::of_block(block).positions_of(region);
            (0..3).all(|k| min[k] < end[k])
        });
        blocks
    }

    /// Works on the frontier voxels of some blocks on all cores, and takes the results in order.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read, or a request to stop.
    pub(crate) fn for_each_block<T: Send>(
        &mut self,
        blocks: &[BlockIndex],
        progress: &(dyn Fn(u64, u64) + Sync),
        work: impl Fn(BlockIndex, FrontierBits) -> T + Sync,
        mut take: impl FnMut(BlockIndex, T),
    ) -> Result<()> {
        let (map, region, reader) = (self.map, self.region, &mut self.reader);
        let sweep =
            Sweep { blocks, memory_bytes: self.options.memory_bytes / 2, stop: &self.options.stop, progress };
        sweep.run(
            |blocks| {
                let cubes = blocks.iter().map(|&block| Cube::of_block(block).grown(1));
                let tiles: FxHashSet<TileIndex> = cubes.flat_map(|cube| cube.tiles(map)).collect();
                let mut tiles: Vec<TileIndex> = tiles.into_iter().collect();
                tiles.sort_unstable();
                reader.read(&tiles)
            },
            |block, loaded| {
                let own = Cube::of_block(block);
                let cube = own.grown(1);
                let bits = BlockBits::of(cube, &cube.tiles(map), loaded);
                let mut inside = Bits::new(cube);
                let [min, end] = region.map_or([[0; 3], [own.edge; 3]], |region| own.positions_of(&region));
                inside.add_box(min.map(|k| k + 1), end.map(|k| k + 1));
                Ok(work(block, FrontierBits::of(&bits, &inside)))
            },
            |block, result| {
                take(block, result);
                Ok(())
            },
        )
    }
}

impl FrontierBits {
    /// Finds the frontier voxels that are `inside`. Around these, the bits must reach one voxel further.
    fn of(bits: &BlockBits, inside: &Bits) -> Self {
        let of_box = |bits: &Bits| Bits::combined([bits, inside], |[bits, inside]| bits & inside);
        let (known, occupied) = (of_box(&bits.known), of_box(&bits.occupied));
        let free = Bits::combined([&known, &occupied], |[known, occupied]| known & !occupied);
        let faces: [Bits; 6] = std::array::from_fn(|k| {
            let neighbor = bits.known.moved(k / 2, k % 2 == 0);
            Bits::combined([&free, &neighbor], |[free, neighbor]| free & !neighbor)
        });
        let [a, b, c, d, e, f] = &faces;
        let frontier = Bits::combined([a, b, c, d, e, f], |faces| faces.iter().fold(0, |all, k| all | k));
        Self { free: free.count(), occupied: occupied.count(), faces, frontier }
    }
}
