use super::OctreeFormat;
use super::bt::PrunedDepths;
use super::bt_bricks::{BtEncoder, BtNode};
use super::header::write_header;
use super::node_encoder::{NodeEncoder, encode};
use super::ot_bricks::{NodeData, OtEncoder, OtNode};
use super::spine::{Block, Spine};
use crate::octree::BrickNodes;
use crate::octree::brick_values::{BrickContent, BrickValues};
use crate::octree::node_colour::NodeColour;
use crate::space::{BrickCode, MortonCode};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::ops::Range;

/// Writes the `.bt` or `.ot` file of a tree larger than memory, block by block. Without colours the result is
/// byte-identical to that of [`write_bt`](super::write_bt) or [`write_ot`](super::write_ot).
///
/// The header, and the bytes before a block, depend on later blocks. Therefore the blocks are first written to a spool,
/// and a few bytes per block are kept in memory.
#[derive(Debug)]
pub struct OctreeStream<S: Read + Write + Seek> {
    blocks: Blocks,
    spool: BufWriter<S>,
    /// Bytes of one block.
    payload: Vec<u8>,
    voxels: u64,
}

#[derive(Debug)]
enum Blocks {
    Bt { encoder: BtEncoder, threshold: f32, pruned: PrunedDepths, blocks: Vec<Block<BtNode>> },
    Ot { blocks: Vec<Block<OtNode<()>>> },
    ColorOt { blocks: Vec<Block<OtNode<NodeColour>>> },
}

/// Extent of pruning in a `.bt` file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BtPruning(Option<PrunedDepths>);

/// Result of a finished [`OctreeStream`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamOutcome {
    /// The file is complete.
    Written {
        /// Number of known voxels.
        voxels: u64,
        /// Number of nodes of the tree.
        nodes: u64,
    },
    /// OctoMap's `prune` stops at a depth without a prunable node, but the stream pruned further. No output was
    /// written: add all blocks again to a stream with this pruning.
    Again(BtPruning),
}

impl<S: Read + Write + Seek> OctreeStream<S> {
    /// Creates a `.bt` stream in which voxels of at least `threshold_log_odds` are occupied. The spool must be empty;
    /// it receives the bytes of the blocks. Start with the default pruning.
    pub fn bt(threshold_log_odds: f32, pruning: BtPruning, spool: S) -> Self {
        let pruned = pruning.0.unwrap_or(PrunedDepths::ALL);
        let encoder = BtEncoder::new(pruned);
        Self::new(Blocks::Bt { encoder, threshold: threshold_log_odds, pruned, blocks: Vec::new() }, spool)
    }

    /// Creates an `.ot` stream.
    pub fn ot(spool: S) -> Self {
        Self::new(Blocks::Ot { blocks: Vec::new() }, spool)
    }

    /// Creates an `.ot` stream of a `ColorOcTree`. Nodes are pruned if log-odds and colours are equal, so that every
    /// voxel keeps its colour; those of inner nodes are averages, as OctoMap's `updateInnerOccupancy` computes them.
    pub fn color_ot(spool: S) -> Self {
        Self::new(Blocks::ColorOt { blocks: Vec::new() }, spool)
    }

    fn new(blocks: Blocks, spool: S) -> Self {
        Self { blocks, spool: BufWriter::with_capacity(1 << 16, spool), payload: Vec::new(), voxels: 0 }
    }

    /// Adds all known voxels of the node at `depth` (0 to 13) whose first voxel is `first`. Nodes must be disjoint and
    /// in Morton order.
    ///
    /// # Errors
    ///
    /// Returns errors from the spool.
    pub fn add_block(&mut self, first: MortonCode, depth: u8, values: &mut BrickValues) -> io::Result<()> {
        if values.is_empty() {
            return Ok(());
        }
        self.voxels += values.len() as u64;
        self.payload.clear();
        let bricks = values.sorted();
        let values = &*values;
        match &mut self.blocks {
            Blocks::Bt { encoder, threshold, blocks, .. } => {
                let mut content = BrickContent::new();
                let mut brick = |encoder: &mut BtEncoder, parts: Range<usize>, out: &mut Vec<u8>| {
                    let code = bricks[parts.start];
                    values.gather(parts, &mut content);
                    let word = |word| content.word(word);
                    let (nodes, _) = BrickNodes::of_values(code, content.known, Some(*threshold), word);
                    encoder.encode_brick(&nodes, out)
                };
                let node = encode(encoder, &bricks, 0..bricks.len(), depth, &mut self.payload, &mut brick);
                blocks.push(Block { first, depth, node, bytes: self.payload.len() as u64 });
            }
            Blocks::Ot { blocks } => {
                let node = encode_ot(values, &bricks, depth, &mut self.payload);
                blocks.push(Block { first, depth, node, bytes: self.payload.len() as u64 });
            }
            Blocks::ColorOt { blocks } => {
                let node = encode_ot(values, &bricks, depth, &mut self.payload);
                blocks.push(Block { first, depth, node, bytes: self.payload.len() as u64 });
            }
        }
        self.spool.write_all(&self.payload)
    }

    /// Writes the file with this resolution.
    ///
    /// # Errors
    ///
    /// Returns errors from the spool or `out`, and [`io::ErrorKind::InvalidInput`] if the resolution is not a
    /// positive, finite length.
    pub fn finish(self, resolution_m: f64, out: &mut impl Write) -> io::Result<StreamOutcome> {
        let Self { blocks, spool, voxels, .. } = self;
        let mut spool = spool.into_inner().map_err(io::IntoInnerError::into_error)?;
        spool.rewind()?;
        let mut out = BufWriter::with_capacity(1 << 16, out);
        let nodes = match blocks {
            Blocks::Bt { mut encoder, pruned, blocks, .. } => {
                let spine = Spine::of(&mut encoder, &blocks);
                if pruned == PrunedDepths::ALL
                    && let Some(depths) = encoder.depths_of_octomap()
                {
                    return Ok(StreamOutcome::Again(BtPruning(Some(depths))));
                }
                let root = spine.node();
                write_header(&mut out, OctreeFormat::Bt, BtEncoder::node_count(&root), resolution_m)?;
                out.write_all(BtEncoder::before_root(&root))?;
                spine.write(&mut spool, &mut out)?;
                BtEncoder::node_count(&root)
            }
            Blocks::Ot { blocks } => {
                write_ot_blocks(&blocks, OctreeFormat::Ot, resolution_m, &mut spool, &mut out)?
            }
            Blocks::ColorOt { blocks } => {
                write_ot_blocks(&blocks, OctreeFormat::ColorOt, resolution_m, &mut spool, &mut out)?
            }
        };
        out.flush()?;
        Ok(StreamOutcome::Written { voxels, nodes })
    }
}

/// Appends the bytes of an `.ot` node over these bricks.
fn encode_ot<D: NodeData>(
    values: &BrickValues,
    bricks: &[BrickCode],
    depth: u8,
    payload: &mut Vec<u8>,
) -> OtNode<D> {
    let mut content = BrickContent::new();
    let mut brick = |encoder: &mut OtEncoder<D>, parts: Range<usize>, out: &mut Vec<u8>| {
        values.gather(parts, &mut content);
        encoder.encode_brick(&content, out)
    };
    encode(&mut OtEncoder::new(), bricks, 0..bricks.len(), depth, payload, &mut brick)
}

/// Writes the `.ot` file of these blocks. Returns the number of its nodes.
fn write_ot_blocks<D: NodeData>(
    blocks: &[Block<OtNode<D>>],
    format: OctreeFormat,
    resolution_m: f64,
    spool: &mut impl Read,
    out: &mut impl Write,
) -> io::Result<u64> {
    let spine = Spine::of(&mut OtEncoder::new(), blocks);
    let nodes = OtEncoder::node_count(&spine.node());
    write_header(out, format, nodes, resolution_m)?;
    spine.write(spool, out)?;
    Ok(nodes)
}
