use super::canvas::Canvas;
use super::cells::{Cell, Cells, Rank};
use super::collect::{Collected, Content, Known};
use super::drawing::Drawing;
use super::frame::Frame;
use super::legend::Entry;
use super::measure::Measure;
use super::options::Picture;
use super::palette::{self, Rgb};
use super::pane::Pane;
use voxtile::space::{Aabb, VoxelBox, VoxelIndex};
use voxtile::{MapConfig, Result};
use voxtile_compare::VoxelClass;

/// The classes of a comparison; a later one hides an earlier one.
pub(super) const CLASSES: [VoxelClass; 9] = [
    VoxelClass::Unchanged,
    VoxelClass::HiddenBefore,
    VoxelClass::HiddenAfter,
    VoxelClass::NotSeenBefore,
    VoxelClass::NotSeenAfter,
    VoxelClass::UncertainAppeared,
    VoxelClass::UncertainVanished,
    VoxelClass::Vanished,
    VoxelClass::Appeared,
];

/// Box around a change, with a label.
pub(super) struct ComparedBox {
    bounds_m: Aabb,
    label: String,
}

/// Returns the color of a class of a comparison, in pictures.
pub fn comparison_color(class: VoxelClass) -> Rgb {
    match class {
        VoxelClass::Unchanged => palette::UNCHANGED,
        VoxelClass::Appeared => palette::APPEARED,
        VoxelClass::Vanished => palette::VANISHED,
        VoxelClass::NotSeenBefore | VoxelClass::NotSeenAfter => palette::NOT_SEEN,
        VoxelClass::HiddenBefore | VoxelClass::HiddenAfter => palette::HIDDEN,
        VoxelClass::UncertainAppeared | VoxelClass::UncertainVanished => palette::UNCERTAIN,
    }
}

/// Returns the color of a class by its position in [`CLASSES`].
pub(super) fn color_of_rank(class: u8) -> Option<Rgb> {
    CLASSES.get(usize::from(class)).map(|class| comparison_color(*class))
}

pub(super) fn legend_entries() -> Vec<Entry> {
    let colors = [
        (palette::APPEARED, "appeared"),
        (palette::VANISHED, "vanished"),
        (palette::UNCERTAIN, "uncertain"),
        (palette::NOT_SEEN, "not seen in one map"),
        (palette::HIDDEN, "hidden in one map"),
        (palette::UNCHANGED, "unchanged"),
    ];
    colors.map(|(color, label)| Entry { color: Some(color), label: label.to_owned() }).into()
}

impl Picture {
    /// Returns a drawing of the compared voxels of a box, which [`Drawing::add_compared`] adds. Its colors are those of
    /// classes. The picture is cropped to the added voxels.
    ///
    /// # Errors
    ///
    /// As [`Picture::draw`].
    pub fn start_comparison(&self, config: &MapConfig, voxels: VoxelBox) -> Result<Drawing<'_>> {
        self.check_flat()?;
        self.check()?;
        let frame = (!voxels.is_empty()).then(|| Frame::new(self.view, voxels, self.most_px));
        let known = frame.map(|frame| {
            let cells = Cells::new(frame.cells[0] * frame.cells[1], None);
            Known { first: [0; 2], count: frame.cells, frame, cells }
        });
        let content = Content::Comparison;
        let collected = Collected { known, content, max_distance_m: 0.0, tiles: 0, unread: Vec::new() };
        Ok(Drawing::new(self, config, collected))
    }
}

impl Drawing<'_> {
    /// Adds a voxel of a comparison. Appeared voxels hide vanished ones, and these uncertain ones, those that one map has
    /// not seen, and unchanged ones; a voxel `in_front` hides all others. Voxels outside of the box are ignored.
    pub fn add_compared(&mut self, voxel: VoxelIndex, class: VoxelClass, in_front: bool) {
        let Some(Known { frame, cells, .. }) = &self.collected.known else { return };
        if !frame.voxels.contains(voxel) {
            return;
        }
        let class = CLASSES.iter().position(|one| *one == class).unwrap_or_default() as u8;
        let rank = if in_front { Rank::InFront(class) } else { Rank::Compared(class) };
        cells.add(frame.place_of(voxel), Cell { rank, value: 0.0, near: frame.view.nearness(voxel) });
    }

    /// Adds a box around a change, in metres, with a label at its upper left corner.
    pub fn add_box(&mut self, bounds_m: Aabb, label: impl Into<String>) {
        self.boxes.push(ComparedBox { bounds_m, label: label.into() });
    }
}

impl ComparedBox {
    /// Draws the box around its cells, which remain visible.
    pub fn draw(&self, canvas: &mut Canvas, frame: &Frame, pane: &Pane, resolution_m: f64, measure: Measure) {
        let [low, high] =
            [self.bounds_m.min, self.bounds_m.max].map(|corner| frame.position_of(corner, resolution_m));
        let ([left, bottom], [right, top]) = (pane.corner_px(low), pane.corner_px(high));
        let gap = measure.px(1.8);
        let (left, top) = (left.saturating_sub(gap), top.saturating_sub(gap));
        let size = [right + gap - left, bottom + gap - top];
        let line = measure.px(0.7);
        canvas.fill(left, top, [size[0], line], palette::INK, 1.0);
        canvas.fill(left, top + size[1] - line, [size[0], line], palette::INK, 1.0);
        canvas.fill(left, top, [line, size[1]], palette::INK, 1.0);
        canvas.fill(left + size[0] - line, top, [line, size[1]], palette::INK, 1.0);
        let (label, space) = (measure.label(), measure.px(1.5));
        let size = [label.width_of(&self.label), label.height()].map(|edge| edge + 2 * space);
        let above = top.saturating_sub(size[1]);
        canvas.fill(left, above, size, palette::UNKNOWN, 0.75);
        canvas.text(left + space, above + space, label, palette::INK, &self.label);
    }
}
